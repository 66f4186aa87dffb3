"""Width of the panels, kept from one window to the next in a file of the user's state folder."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path

from texvol.util import text_files, writing
from texvol.util.errors import InputError
from texvol.window import recent
from texvol.window.desk import NARROWEST_PANEL, PANEL_WIDTH, WIDEST_PANEL

_MOST_BYTES = 1 << 16


def state_file() -> Path:
    """Return the path of the state file."""
    return recent.state_file().with_name("window.json")


def panel_width() -> float:
    """Return the kept width of the panels, in window coordinates at scale 1; the default if none is kept."""
    with suppress(OSError, ValueError, RuntimeError):
        content = text_files.parsed_json(text_files.read_text(state_file(), "JSON", _MOST_BYTES), str(state_file()))
        width = content.get("panel-width") if isinstance(content, dict) else None
        if isinstance(width, int | float) and NARROWEST_PANEL <= width <= WIDEST_PANEL:
            return float(width)
    return PANEL_WIDTH


def keep(width: float) -> None:
    """Keep the width of the panels; it is lost if the folder can't be written."""
    if width == panel_width():
        return
    with suppress(OSError, RuntimeError, InputError):
        state_file().parent.mkdir(parents=True, exist_ok=True)
        writing.write_files({state_file(): (json.dumps({"panel-width": width}) + "\n").encode()})
