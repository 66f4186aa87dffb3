"""What is taken home: scene files, names for pictures, the command line that draws the very picture again."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from texvol.util import writing
from texvol.util.errors import InputError
from texvol.window.document import Document, Saved
from texvol.window.scene_writing import scene_files

# What is not said is chosen by `render` alike.
_OPTIONS = {
    "slab_thickness": "--slab-thickness",
    "sampling_rate": "--sampling-rate",
    "max_error": "--max-error",
    "texture_format": "--texture-format",
    "target_format": "--target-format",
    "early_termination": "--early-termination",
}


def default_name(document: Document, suffix: str) -> str:
    """A name in the current folder that is not taken: of the volume, numbered."""
    name = Path(document.origin.volume).name or "scene"
    stem = name.split(".")[0] or "scene"
    number = 1
    while os.path.lexists(f"{stem}-{number}{suffix}"):
        number += 1
    return f"{stem}-{number}{suffix}"


def scene_name(document: Document) -> str:
    """Where a scene is saved unless told: in the file that it was opened from, or saved in before."""
    return document.origin.scene_file or default_name(document, ".toml")


def check_writable(path: str) -> None:
    """Raise InputError if no scene file can be written there, or it is called otherwise."""
    if not path.lower().endswith(".toml"):
        raise InputError(f"{path}: a scene file's name ends with .toml")
    writing.check_writable(path)


def save_scene(path: str, document: Document, size: tuple[int, int]) -> None:
    """Write the scene file, and its transfer function beside it.

    Raises
    ------
    InputError
        If that can't be done.
    """
    check_writable(path)
    files = scene_files(path, document.scene, size, document.showing)
    writing.write_files({str(name): content for name, content in files.items()})
    document.saved = Saved(path, document.scene, document.showing, size)


def command_line(document: Document, size: tuple[int, int], accuracy: Mapping[str, Any]) -> list[str]:
    """Words of the command that draws the picture; saves the scene for it, unless that is done."""
    saved = document.saved
    as_is = saved is not None and saved.scene is document.scene and saved[2:] == (document.showing, size)
    if saved is not None and as_is and os.path.exists(saved.path):
        path = saved.path
    else:
        path = default_name(document, ".toml")
        save_scene(path, document, size)
    words = ["texvol", "render", "--scene", path]
    for name, option in _OPTIONS.items():
        value = accuracy.get(name)
        if value is not None:
            words += [option, repr(value) if isinstance(value, float) else str(value)]
    if accuracy.get("skip_empty") is False:
        words.append("--no-skip-empty")
    return [*words, "-o", str(Path(path).with_suffix(".png"))]
