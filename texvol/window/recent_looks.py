"""Transfer-function files that were used lately, kept beside the list of recent files."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path

from texvol.util import text_files, writing
from texvol.window.recent import state_file

_MOST = 8
_MOST_BYTES = 1 << 16


def list_file() -> Path:
    """Return the path of the list."""
    return state_file().with_name("looks.json")


def files() -> list[str]:
    """Return the files that exist, the latest first."""
    with suppress(OSError, ValueError, RuntimeError):
        content = text_files.parsed_json(text_files.read_text(list_file(), "JSON", _MOST_BYTES), str(list_file()))
        found = content if isinstance(content, list) else []
        return [each for each in found if isinstance(each, str) and os.path.isfile(each)][:_MOST]
    return []


def add(path: str) -> None:
    """Put a file at the front of the list."""
    with suppress(OSError, RuntimeError, ValueError):  # the list is lost if the folder can't be written
        newest = os.path.abspath(path)
        kept = [newest, *(each for each in files() if each != newest)][:_MOST]
        list_file().parent.mkdir(parents=True, exist_ok=True)
        writing.write_files({list_file(): (json.dumps(kept, indent=1) + "\n").encode()})
