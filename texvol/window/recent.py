"""Files that were opened lately, in a file of the user's own state folder."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path

from texvol import writing

_MOST = 10


def place() -> Path:
    """Where they are kept (XDG base directories)."""
    folder = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local/state")
    return Path(folder) / "texvol" / "recent.json"


def files() -> list[str]:
    """Paths, the latest first; those that are gone are left out."""
    with suppress(OSError, ValueError, RuntimeError):
        found = json.loads(place().read_text("utf-8"))
        if isinstance(found, list):
            return [each for each in found if isinstance(each, str) and os.path.exists(each)][:_MOST]
    return []


def add(path: str) -> None:
    """Another file is the latest."""
    with suppress(OSError, RuntimeError, ValueError):  # a home that can't be written to is no reason to complain
        absolute = os.path.abspath(path)
        kept = [absolute, *(each for each in files() if each != absolute)][:_MOST]
        place().parent.mkdir(parents=True, exist_ok=True)
        writing.write_files({place(): (json.dumps(kept, indent=1) + "\n").encode()})
