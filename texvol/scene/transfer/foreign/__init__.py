"""Transfer functions of other programs, read as the content of a file of texvol's own, and written.

    ParaView         .json         RGBPoints and Points; VTK's and vtk.js's colour maps are the same
    VTK              .json         states of vtkVolumeProperty as its object manager exports them
    3D Slicer        .vp.json, .vp
    Inviwo           .itf
    MRIcroGL         .clut
    VisRTX and ANARI .1dt          rows of red, green, blue and opacity

All of them have opacities of a length, and colours in sRGB. The length is that of `--unit-distance`, or the file's own;
without both it is the one that the program takes by itself, and a remark says so.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from typing import Any, NamedTuple

from texvol.scene.transfer.foreign import json_forms, text_forms
from texvol.scene.transfer.foreign.content import Content
from texvol.util import remarks, text_files
from texvol.util.errors import InputError

_MOST_BYTES = 64 << 20
_LAST_COMMA = re.compile(r'("(?:[^"\\]|\\.)*")|,(?=\s*[\]}])')  # or a text, in which a comma stays
_TEXTS: dict[str, tuple[str, Callable[[str], Content]]] = {
    ".vp": ("a volume property of 3D Slicer", text_forms.slicer),
    ".itf": ("a transfer function of Inviwo", text_forms.inviwo),
    ".clut": ("a colour table of MRIcroGL", text_forms.mricrogl),
    ".1dt": ("rows of red, green, blue and opacity", text_forms.rows),
}
ENDINGS = tuple(_TEXTS)  # beside .json


class _Remark(NamedTuple):
    """Sentence that a command tells at its end."""

    notes: tuple[str, ...]


def is_foreign_text(path: str | os.PathLike[str]) -> bool:
    """True if the name of a file is that of another program's transfer function, but for JSON."""
    return os.fspath(path).lower().endswith(tuple(_TEXTS))


def read_text(path: str | os.PathLike[str], unit_distance: float | None = None) -> dict[str, Any]:
    """Return the content of a file whose form its name tells, but for JSON.

    Raises
    ------
    InputError
        If it cannot be read, or is not of that form.
    """
    kind, parse = _TEXTS[os.path.splitext(os.fspath(path))[1].lower()]
    text = text_files.read_text(path, kind, _MOST_BYTES)
    try:
        content = parse(text)
    except (ValueError, OverflowError) as error:
        message = str(error) if isinstance(error, InputError) else f"is not {kind}: {error}"
        raise InputError(f"{os.fspath(path)}: {message}") from None
    return _told(path, content, unit_distance)


def located(path: str | os.PathLike[str]) -> tuple[str, str | None]:
    """Return the file and the name of FILE.json::NAME, one colour map of a list; None for the name of other paths."""
    text = os.fspath(path)
    head, separator, name = text.partition(".json::")
    return (f"{head}.json", name) if separator and name and not os.path.exists(text) else (text, None)


def parsed_json(text: str, name: str) -> Any:
    """Return the content of a JSON text; ParaView's may have commas before closing brackets, as its own list has.

    Raises
    ------
    InputError
        If it is not JSON.
    """
    try:
        return text_files.parsed_json(text, name)
    except InputError:
        if "RGBPoints" not in text:
            raise
        without = _LAST_COMMA.sub(lambda found: found[1] or "", text)
        if without == text:
            raise
        return text_files.parsed_json(without, name)


def of_json(
    path: str | os.PathLike[str], parsed: Any, unit_distance: float | None = None, name: str | None = None
) -> dict[str, Any] | None:
    """Return the content of a JSON text of another program, or None if it is none of those that are known.

    Raises
    ------
    InputError
        If it is of one of those programs and malformed, or if a transfer function of texvol is given a unit distance.
    """
    try:
        found = json_forms.read(parsed, name)
    except InputError as error:
        raise InputError(f"{os.fspath(path)}: {error}") from None
    return None if found is None else _told(path, found, unit_distance)


def _told(path: str | os.PathLike[str], content: Content, unit_distance: float | None) -> dict[str, Any]:
    """Return the content with the length of its opacities, and remark what was taken."""
    try:
        fields, notes = content.with_length(unit_distance)
    except InputError as error:
        raise InputError(f"{os.fspath(path)}: {error}") from None
    name = os.path.basename(os.fspath(path))
    for note in notes:
        remarks.make_at_end(_Remark((f"{name}: {note}",)))
    return fields
