"""Files that were opened lately, and how each was read, in a file of the user's own state folder."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from texvol import writing
from texvol.readers import ARGUMENTS
from texvol.window.naming import called

_MOST = 10


@dataclass(frozen=True)
class Recent:
    """A file, and what was said of how it is read: the arguments of `texvol.readers.load`."""

    path: str
    how: Mapping[str, Any] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """What it is called."""
        return called(self.path, self.how)

    def as_json(self) -> Any:
        """The path alone where nothing has to be said."""
        return {"path": self.path, **self.how} if self.how else self.path

    @classmethod
    def from_json(cls, content: Any) -> Recent | None:
        """What `as_json` wrote; None if it is something else."""
        if isinstance(content, str):
            return cls(content)
        if not isinstance(content, dict) or not isinstance(content.get("path"), str):
            return None
        how = {key: tuple(each) if isinstance(each, list) else each for key, each in content.items() if key != "path"}
        return cls(content["path"], how) if set(how) <= set(ARGUMENTS) else None


def place() -> Path:
    """Where they are kept (XDG base directories)."""
    folder = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local/state")
    return Path(folder) / "texvol" / "recent.json"


def files() -> list[Recent]:
    """The latest first; those that are gone are left out."""
    with suppress(OSError, ValueError, RuntimeError):
        content = json.loads(place().read_text("utf-8"))
        found = map(Recent.from_json, content if isinstance(content, list) else [])
        return [each for each in found if each is not None and os.path.exists(each.path)][:_MOST]
    return []


def add(path: str, how: Mapping[str, Any]) -> None:
    """Another file is the latest; the same one, read in another way, is another."""
    with suppress(OSError, RuntimeError, ValueError, TypeError):  # a home that can't be written to is no reason to stop
        told = {key: tuple(each) if isinstance(each, list) else each for key, each in how.items()}
        newest = Recent(os.path.abspath(path), told)
        kept = [newest, *(each for each in files() if each != newest)][:_MOST]
        place().parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps([each.as_json() for each in kept], indent=1)
        writing.write_files({place(): (text + "\n").encode()})
