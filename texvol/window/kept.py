"""Width of the panels and size of the picture, kept for the next window in a file of the user's state folder."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

from texvol.util import text_files, writing
from texvol.util.errors import InputError
from texvol.window import recent
from texvol.window.desk import NARROWEST_PANEL, PANEL_WIDTH, WIDEST_PANEL

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


def keep(width: float, size: tuple[int, int] | None = None) -> None:
    """Keep the width of the panels, and the size of the picture if it is given.

    They are lost if the folder can't be written.
    """
    before = _content()
    content = before | ({"panel-width": width} if width != panel_width() else {})
    if size is not None and min(size) >= _LEAST:
        content |= {"picture-size": list(size)}
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
