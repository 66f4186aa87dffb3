"""Choices that are kept for the next window, in a file of the user's state folder.

They are the width of the panels, the size of the picture, the layout of slices and 3D view, and the switches of what
the window draws over the 3D view.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from texvol.util import text_files, writing
from texvol.util.errors import InputError
from texvol.window import recent
from texvol.window.desk import NARROWEST_PANEL, PANEL_WIDTH, WIDEST_PANEL, Desk
from texvol.window.layout import VIEWS

_MOST_BYTES = 1 << 16
_LEAST, _MOST = 200, 16384  # sides of a picture: a smaller window is no choice for the next one


def state_file() -> Path:
    """Return the path of the state file."""
    return recent.state_file().with_name("window.json")


def panel_width() -> float:
    """Return the kept width of the panels, in window coordinates at scale 1; the default if none is kept."""
    width = _content().get("panel-width")
    return float(width) if isinstance(width, int | float) and NARROWEST_PANEL <= width <= WIDEST_PANEL else PANEL_WIDTH


def picture_size() -> tuple[int, int] | None:
    """Return the kept size of the picture in window coordinates; None if none is kept."""
    size = _content().get("picture-size")
    if not isinstance(size, list) or len(size) != 2 or not all(type(side) is int for side in size):
        return None
    width, height = size
    return (width, height) if all(_LEAST <= side <= _MOST for side in size) else None


def views_of(desk: Desk) -> dict[str, bool | str]:
    """Return the layout, and the switches of what is drawn over the 3D view, by their names in the file."""
    layout = desk.layout
    return {
        "slices": layout.shown, "large-view": layout.large, "outlines-in-3d": layout.planes,
        "slices-in-3d": layout.pictures, "orientation-cube": desk.moving.cube,
    }  # fmt: skip


def restore_views(desk: Desk) -> None:
    """Set the layout and the switches that are kept; what is missing or damaged stays as it is."""
    layout, found = desk.layout, views_of(desk)
    for name, each in _content().items():
        known = each in ("", *VIEWS) if name == "large-view" else isinstance(each, bool)
        if name in found and known:
            found[name] = each
    layout.shown, layout.large = bool(found["slices"]), str(found["large-view"])
    layout.planes, layout.pictures = bool(found["outlines-in-3d"]), bool(found["slices-in-3d"])
    desk.moving.cube = bool(found["orientation-cube"])


def keep(width: float, size: tuple[int, int] | None = None, views: Mapping[str, bool | str] | None = None) -> None:
    """Keep the width of the panels, and the size of the picture and the views if they are given.

    They are lost if the folder can't be written.
    """
    before = _content()
    content = before | ({"panel-width": width} if width != panel_width() else {})
    if size is not None and min(size) >= _LEAST:
        content |= {"picture-size": list(size)}
    content |= views or {}
    if content == before:
        return
    with suppress(OSError, RuntimeError, InputError):
        state_file().parent.mkdir(parents=True, exist_ok=True)
        writing.write_files({state_file(): (json.dumps(content) + "\n").encode()})


def _content() -> dict[str, Any]:
    """Return what is kept; nothing if the file is damaged or missing."""
    with suppress(OSError, ValueError, RuntimeError):
        content = text_files.parsed_json(text_files.read_text(state_file(), "JSON", _MOST_BYTES), str(state_file()))
        if isinstance(content, dict):
            return content
    return {}
