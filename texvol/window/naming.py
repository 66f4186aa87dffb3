"""What volumes are called: by their file, and by how it was read, since one file may hold several."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from texvol.formats.readers import ARGUMENTS
from texvol.scene.volume import Volume

_SAYS_WHICH = ("series", "channel", "variable", "time", "shape", "dtype", "labels", "color")


def how_read(source: Mapping[str, Any]) -> dict[str, Any]:
    """What has to be said to read a volume again, of what is known of where it came from."""
    return {key: source[key] for key in ARGUMENTS if source.get(key) is not None}


def called(path: str, how: Mapping[str, Any]) -> str:
    """A file's name without its folder, and which of its contents are meant."""
    name = os.path.basename(os.path.normpath(path)) or path
    return ", ".join([name, *(_said(key, how[key]) for key in _SAYS_WHICH if key in how)])


def volume_called(volume: Volume, most: int = 0) -> str:
    """The same of a volume; a longer file name than `most` letters loses its middle."""
    how = how_read(volume.source)
    name = os.path.basename(os.path.normpath(volume.name)) or volume.name
    return called(shortened(name, most) if most else name, how)


def shortened(text: str, most: int) -> str:
    """A text of at most so many letters; beginning and end of a longer one, which tell names apart."""
    if len(text) <= most:
        return text
    tail = (most - 1) // 2
    return text[: most - 1 - tail] + "…" + (text[-tail:] if tail else "")


def _said(key: str, value: Any) -> str:
    if isinstance(value, bool):
        return key
    if isinstance(value, list | tuple):
        return f"{key} " + "x".join(map(str, value))
    return f"{key} {value}"
