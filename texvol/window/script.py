"""Input recorded and played back: a text file with one JSON object on each line.

    {"t": 0.5, "kind": "move", "x": 200, "y": 300}         an event, see `events`, t seconds after the start
    {"t": 2.0, "do": "rest"}                               wait until the picture is at rest; the clock stands still
    {"t": 2.0, "do": "screenshot", "file": "a.png"}        what is in the window
    {"t": 2.0, "do": "save", "file": "a.toml"}             the scene
    {"t": 2.1, "do": "command", "name": "axis +x"}         what a key does, or a panel
    {"t": 9.0, "do": "mark", "name": "end of the turn"}    a word in the table of frame times

The clock starts with the first picture. Lines that are empty, or begin with #, say nothing.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TextIO

from texvol.formats.pictures import image
from texvol.util import text_files, writing
from texvol.util.errors import InputError
from texvol.window import saving
from texvol.window.commands import is_command
from texvol.window.events import Event

_MOST_BYTES = 16 << 20  # an hour of moves
ACTIONS = ("rest", "screenshot", "save", "command", "mark")


@dataclass(frozen=True)
class Action:
    """Something to be done that is no event: one of ACTIONS."""

    do: str
    file: str = ""
    name: str = ""


@dataclass(frozen=True)
class Step:
    """An event or an action, and when; seconds after the start."""

    t: float
    what: Event | Action


def read(path: str | os.PathLike[str]) -> list[Step]:
    """The steps of a script, in the order of time.

    Raises
    ------
    InputError
        If it can't be read, or a line says nothing that can be played.
    """
    lines = text_files.read_text(path, "a script", _MOST_BYTES).splitlines()
    steps = []
    for number, line in enumerate(lines, start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            where = f"{path}:{number}"
            content = text_files.parsed_json(line, f"{where}: a step is a JSON object, and not {line.strip()[:60]!r}")
            try:
                steps.append(_step(content))
            except ValueError as error:
                raise InputError(f"{where}: {error}") from None
    return sorted(steps, key=lambda step: step.t)


def _step(content: Any) -> Step:
    if not isinstance(content, dict):
        raise InputError(f"a step is a JSON object, and not {content!r}")
    rest = dict(content)
    t = rest.pop("t", 0.0)
    if not isinstance(t, int | float) or not 0 <= t < 1e6:
        raise InputError(f"t is a time in seconds from 0 upwards, and not {t!r}")
    if "do" not in rest:
        event = Event.from_json(rest)
        if event.kind == "resize" and not (event.x >= 1 and event.y >= 1):
            raise InputError(f"a window has a size from 1 upwards, and not {event.x:g} x {event.y:g}")
        return Step(float(t), event)
    unknown = set(rest) - {"do", "file", "name"}
    if rest["do"] not in ACTIONS or unknown or not all(isinstance(each, str) for each in rest.values()):
        raise InputError(f'"do" is one of {", ".join(ACTIONS)}, with a "file" or a "name", and not {content!r}')
    action = Action(**rest)
    _check(action)
    return Step(float(t), action)


def _check(action: Action) -> None:
    """What can't be done is better known before the window opens than when its turn comes."""
    if action.do == "command" and not is_command(action.name):
        raise InputError(f"there is no command {action.name!r}")
    if action.do == "screenshot":
        if not action.file:
            raise InputError('a screenshot needs a "file"')
        image.check_writable(action.file)
    if action.do == "save" and action.file:
        saving.check_writable(action.file)


class Player:
    """Plays steps back in time."""

    def __init__(self, steps: Iterable[Step]) -> None:
        self._steps = list(steps)
        self._next = 0
        self._clock = 0.0
        self._before: float | None = None

    @property
    def over(self) -> bool:
        """Whether everything has been played."""
        return self._next >= len(self._steps)

    @property
    def waits(self) -> bool:
        """Whether the clock stands still until the picture is at rest."""
        return not self.over and self._is_due() and self._steps[self._next].what == Action("rest")

    def due(self, now: float, *, at_rest: bool) -> list[Event | Action]:
        """What is due at `now`, seconds of any clock; stops at an action, so that it sees what came before it."""
        if self._before is not None and not self.waits:
            self._clock += now - self._before
        self._before = now
        found: list[Event | Action] = []
        while not self.over and self._is_due():
            what = self._steps[self._next].what
            if isinstance(what, Action) and (found or (what.do == "rest" and not at_rest)):
                break
            self._next += 1
            found.append(what)
            if isinstance(what, Action):
                break
        return found

    def _is_due(self) -> bool:
        return self._steps[self._next].t <= self._clock


class Recorder:
    """Writes what happens as a script."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        writing.check_writable(path)
        self._path = path
        try:
            self._file: TextIO = open(path, "w", encoding="utf-8")  # noqa: SIM115 (open for as long as the window)
        except OSError as error:
            raise InputError(f"{path}: cannot be written: {writing.reason_of(error)}") from None
        self._start: float | None = None

    def add(self, events: Iterable[Event], now: float) -> None:
        """Events of a frame."""
        self._start = now if self._start is None else self._start
        for event in events:
            content = {"t": round(now - self._start, 4)} | event.as_json()
            with self._faults():
                self._file.write(json.dumps(content, ensure_ascii=False) + "\n")

    def close(self) -> None:
        """No more events."""
        with self._faults():
            self._file.close()

    @contextmanager
    def _faults(self) -> Iterator[None]:
        """Raise InputError where the file cannot be written any more."""
        try:
            yield
        except OSError as error:
            raise InputError(f"{self._path}: cannot be written: {writing.reason_of(error)}") from None
