"""Recently opened files with their reading options, kept in a file of the user's state folder."""

from __future__ import annotations

import json
import os
from argparse import ArgumentTypeError
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from texvol.options.groups import SCENE_OPTIONS
from texvol.options.reading import READING
from texvol.scene.scene import Scene
from texvol.util import reach, text_files, writing
from texvol.util.errors import InputError
from texvol.util.locations import absolute, is_remote, may_exist
from texvol.window.naming import called
from texvol.window.scene_writing import volume_table

_MOST = 10
_MOST_BYTES = 1 << 20
_TOLD = READING | {name: SCENE_OPTIONS[name] for name in ("spacing", "transform", "space", "mask", "add")}


@dataclass(frozen=True)
class Recent:
    """Recently opened file, with the options of its scene file: how it is read and placed, and the added volumes."""

    path: str
    how: Mapping[str, Any] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """Displayed name, without the time step: the window has a slider for it."""
        named = [(self.path, self.how), *((each["file"], each) for each in self.how.get("add", ()))]
        files: dict[tuple[str, str], list[Any]] = {}  # channels, by file and how it is read
        for path, how in named:
            rest = {key: value for key, value in how.items() if key not in ("time", "channel")}
            files.setdefault((path, called(path, rest)), []).append(how.get("channel"))
        return " + ".join(each for (path, name), channels in files.items() for each in _of_channels(name, channels))

    @property
    def options(self) -> dict[str, Any]:
        """Options for the namespace of the command line.

        Raises
        ------
        InputError
            If an option is not valid.
        """
        try:
            return {name: _TOLD[name.replace("_", "-")].from_file(value) for name, value in self.how.items()}
        except ArgumentTypeError as error:
            raise InputError(f"{self.path}: {error}") from None

    def as_json(self) -> Any:
        """Return the path alone, or an object with the path and the options if there are any."""
        return {"path": self.path, **self.how} if self.how else self.path

    @classmethod
    def from_json(cls, content: Any) -> Recent | None:
        """Return the file that `as_json` described; None if the content is not valid."""
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


def _of_channels(name: str, channels: Sequence[Any]) -> list[str]:
    """Return the displayed names of the channels of a file, one name for several; None stands for no channel."""
    chosen = [str(each) for each in channels if each is not None]
    plain = [name] * (len(channels) - len(chosen))
    return plain + [f"{name}, channel{'s' * (len(chosen) > 1)} {', '.join(chosen)}"] * bool(chosen)


def _how(scene: Scene) -> dict[str, Any]:
    """Return the options that read and place a scene's volumes again, except the first volume's path."""
    first, *others = (volume_table(scene, number) for number in range(len(scene.volumes)))
    del first["file"]
    return first | ({"add": others} if others else {})


def state_file() -> Path:
    """Return the path of the state file (XDG base directories)."""
    folder = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local/state")
    return Path(folder) / "texvol" / "recent.json"


def files() -> list[Recent]:
    """Return the recent files, the latest first; files that no longer exist are left out."""
    with suppress(OSError, ValueError, RuntimeError):
        content = text_files.parsed_json(text_files.read_text(state_file(), "JSON", _MOST_BYTES), str(state_file()))
        found = map(Recent.from_json, content if isinstance(content, list) else [])
        there = (each for each in found if each is not None and reach.holds(each.path) and may_exist(each.path))
        return list(islice(there, _MOST))
    return []


def folders() -> list[Path]:
    """Return the folders of recent files, the current folder and the home folder."""
    found = [os.path.dirname(each.path) for each in files() if not is_remote(each.path)]
    known = [*reach.folders(), os.path.abspath("."), *found, str(Path.home())]
    return [Path(folder) for folder in dict.fromkeys(known) if reach.holds(folder) and os.path.isdir(folder)]


def remember(path: str, scene: Scene | None) -> None:
    """Add a file that was opened; a scene of arrays is left out, as no file holds it. None: the file is a scene's."""
    with suppress(InputError):
        add(path, {} if scene is None else _how(scene))


def add(path: str, options: Mapping[str, Any]) -> None:
    """Put a file at the front of the list; the same file with other options is another entry."""
    with suppress(OSError, RuntimeError, ValueError, TypeError):  # the list is lost if the folder can't be written
        newest = Recent(absolute(path), json.loads(json.dumps(options)))  # tuples become lists, to be compared
        kept = [newest, *(each for each in files() if each != newest)][:_MOST]
        state_file().parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps([each.as_json() for each in kept], indent=1)
        writing.write_files({state_file(): (text + "\n").encode()})
