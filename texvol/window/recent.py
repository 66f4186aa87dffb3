"""Files that were opened lately, and how each was read, in a file of the user's own state folder."""

from __future__ import annotations

import json
import os
from argparse import ArgumentTypeError
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from texvol.options.groups import SCENE_OPTIONS
from texvol.options.reading import READING
from texvol.scene.scene import Scene
from texvol.util import text_files, writing
from texvol.util.errors import InputError
from texvol.window.naming import called
from texvol.window.scene_writing import volume_table

_MOST = 10
_MOST_BYTES = 1 << 20
_TOLD = READING | {name: SCENE_OPTIONS[name] for name in ("spacing", "transform", "mask", "add")}


@dataclass(frozen=True)
class Recent:
    """A file, and what was said of how it is read and placed, and of what is added to it, as a scene file has it."""

    path: str
    how: Mapping[str, Any] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """What it is called."""
        further = (called(each["file"], each) for each in self.how.get("add", ()))
        return " + ".join([called(self.path, self.how), *further])

    @property
    def options(self) -> dict[str, Any]:
        """The same as options of the command line, in a namespace.

        Raises
        ------
        InputError
            If that is none.
        """
        try:
            return {name: _TOLD[name].from_file(value) for name, value in self.how.items()}
        except ArgumentTypeError as error:
            raise InputError(f"{self.path}: {error}") from None

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
        found = cls(content["path"], {key: value for key, value in content.items() if key != "path"})
        try:
            _ = found.options, found.text
        except (InputError, KeyError, OverflowError, TypeError, ValueError):
            return None
        return found


def how(scene: Scene) -> dict[str, Any]:
    """What has to be said to have the volumes of a scene again where they are, beside the first one's path."""
    first, *others = (volume_table(scene, number) for number in range(len(scene.volumes)))
    del first["file"]
    return first | ({"add": others} if others else {})


def position() -> Path:
    """Where they are kept (XDG base directories)."""
    folder = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local/state")
    return Path(folder) / "texvol" / "recent.json"


def files() -> list[Recent]:
    """The latest first; those that are gone are left out."""
    with suppress(OSError, ValueError, RuntimeError):
        content = text_files.parsed_json(text_files.read_text(position(), "JSON", _MOST_BYTES), str(position()))
        found = map(Recent.from_json, content if isinstance(content, list) else [])
        return [each for each in found if each is not None and os.path.exists(each.path)][:_MOST]
    return []


def add(path: str, told: Mapping[str, Any]) -> None:
    """Another file is the latest; the same one, read in another way, is another."""
    with suppress(OSError, RuntimeError, ValueError, TypeError):  # a home that can't be written to is no reason to stop
        newest = Recent(os.path.abspath(path), json.loads(json.dumps(told)))  # with lists, as the others
        kept = [newest, *(each for each in files() if each != newest)][:_MOST]
        position().parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps([each.as_json() for each in kept], indent=1)
        writing.write_files({position(): (text + "\n").encode()})
