"""Displayed names of volumes: the file name, and the reading options that tell contents of one file apart."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from texvol.formats.readers import ARGUMENTS
from texvol.scene.channel import called as channel_called
from texvol.scene.volume import Volume

_SAYS_WHICH = ("series", "image", "channel", "variable", "time", "level", "shape", "dtype", "labels", "blocks", "color")


def how_read(source: Mapping[str, Any]) -> dict[str, Any]:
    """Return the reading options of a volume, from its source."""
    return {key: source[key] for key in ARGUMENTS if source.get(key) is not None}


def called(path: str, how: Mapping[str, Any]) -> str:
    """Return a file's name without its folder, followed by the options that choose one of its contents."""
    name = os.path.basename(os.path.normpath(path)) or path
    return ", ".join([name, *(_said(key, how[key]) for key in _SAYS_WHICH if key in how)])


def volume_called(volume: Volume, most: int = 0) -> str:
    """Return a volume's displayed name, that of its channel first if it has one.

    A file name of more than `most` letters is shortened, unless `most` is 0.
    """
    how = how_read(volume.source)
    name = os.path.basename(os.path.normpath(volume.name)) or volume.name
    name = shortened(name, most) if most else name
    channel = channel_called(volume.channel, how.pop("channel", None))
    return f"{channel}, {called(name, how)}" if channel else called(name, how)


def shortened(text: str, most: int) -> str:
    """Return a text of at most `most` letters; a longer text keeps its beginning and its end."""
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
