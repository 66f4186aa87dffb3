"""Saving of scenes: file names, scene files, and the command line that draws the shown picture."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from texvol.util import writing
from texvol.util.errors import InputError
from texvol.util.locations import is_remote
from texvol.window import volume_list
from texvol.window.document import Document, Saved
from texvol.window.own_files import real, unused
from texvol.window.scene_writing import scene_files, transfer_function_path

# Without these options `texvol render` makes the same choices as the window.
_OPTIONS = (
    *("slab-thickness", "sampling-rate", "max-error"),
    *("texture-format", "target-format", "early-termination", "slicing", "texture-refinement", "shadow-nodes"),
)


def default_name(document: Document, suffix: str, taken: Collection[str] = ()) -> str:
    """Return an unused file name in the current folder: the volume's name with a number.

    `taken` are the real paths of files that are still to be written.
    """
    stem = Path(document.origin.volume).name.split(".")[0] or "scene"
    if suffix == ".toml":
        return _unused_scene(stem + suffix, document, taken)
    return unused(stem + suffix, lambda name: [name], taken=taken)


def _unused_scene(path: str, document: Document, taken: Collection[str]) -> str:
    return unused(path, lambda name: files_of(name, document), taken=taken)


def files_of(path: str, document: Document) -> list[str]:
    """Return the files that a scene file consists of: itself, and its transfer functions."""
    count = len(volume_list.entries(document.scene, document.off))
    return [path, *(str(transfer_function_path(Path(path), number)) for number in range(count))]


def scene_name(document: Document, taken: Collection[str] = ()) -> str:
    """Return the default path of a saved scene: the file that the scene was opened from or last saved in.

    If that is one of `taken`, the real paths of files of others, return an unused name.
    """
    own = document.origin.scene_file
    if own is None:
        return default_name(document, ".toml", taken)
    return _unused_scene(own, document, taken) if real(own) in taken else own


def check_writable(path: str) -> None:
    """Raise InputError if no scene file can be written at a path, or if its name does not end with .toml."""
    if not path.lower().endswith(".toml"):
        raise InputError(f"{path}: the name of a scene file must end with .toml")
    writing.check_writable(path)


def save_scene(path: str, document: Document, size: tuple[int, int]) -> None:
    """Write the scene file, and its transfer functions beside it; the document has no unsaved changes then.

    Raises
    ------
    InputError
        If a file can't be written, or a scene file can't describe the scene.
    """
    _write(path, document, size)
    document.saved, document.kept_tour = document.written, document.tour


def lost_files(document: Document) -> list[str]:
    """Return the files of the scene's volumes and masks that no longer exist: the saved scene can't be opened."""
    owners = [entry.owner for entry in volume_list.entries(document.scene, document.off)]
    sources = [each.source for owner in owners for each in (owner.volume, owner.mask) if each is not None]
    files = [str(source["absolute"]) for source in sources if source.get("absolute")]
    return [each for each in dict.fromkeys(files) if not is_remote(each) and not os.path.exists(each)]


def _write(path: str, document: Document, size: tuple[int, int]) -> None:
    """Write the scene file, and its transfer functions beside it."""
    check_writable(path)
    files = scene_files(path, document.scene, size, document.showing, document.off, document.tour)
    writing.write_files({str(name): content for name, content in files.items()})
    document.written = Saved(path, document.scene, document.showing, size, document.off.volumes)


def command_line(document: Document, size: tuple[int, int], accuracy: Mapping[str, Any]) -> list[str]:
    """Return the words of the command that draws the picture; if no scene file has it, a new one is written."""
    last = document.written
    now = document.scene, document.showing, size, document.off.volumes
    if last is not None and last.scene is now[0] and last[1:] == now and os.path.exists(last.path):
        path = last.path
    else:
        path = default_name(document, ".toml")
        _write(path, document, size)
    words = ["texvol", "render", "--scene", path]
    for option in _OPTIONS:
        value = accuracy.get(option.replace("-", "_"))
        if value is not None:
            words += [f"--{option}", repr(value) if isinstance(value, float) else str(value)]
    if accuracy.get("skip_empty") is False:
        words.append("--no-skip-empty")
    return [*words, "-o", str(Path(path).with_suffix(".png"))]
