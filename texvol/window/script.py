"""Recorded input: a text file with one JSON object per line.

    {"t": 0.5, "kind": "move", "x": 200, "y": 300}         an event, see `events`, t seconds after the start
    {"t": 2.0, "do": "rest"}                               stop the clock until the picture is at rest
    {"t": 2.0, "do": "screenshot", "file": "a.png"}        save a picture of the window
    {"t": 2.0, "do": "save", "file": "a.toml"}             save the scene
    {"t": 2.1, "do": "command", "name": "axis +x"}         run a command of a key or a panel
    {"t": 9.0, "do": "mark", "name": "end of the turn"}    write a word into the table of frame times

The clock starts with the first picture. Empty lines and lines that begin with # are ignored.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from texvol.formats.pictures import image
from texvol.util import text_files, writing
from texvol.util.errors import InputError
from texvol.window import saving
from texvol.window.commands import is_command
from texvol.window.events import Event

_MOST_BYTES = 16 << 20  # an hour of mouse moves
ACTIONS = ("rest", "screenshot", "save", "command", "mark")


@dataclass(frozen=True)
class Action:
    """Step of a script that is not an event: one of ACTIONS."""

    do: str
    file: str = ""
    name: str = ""


@dataclass(frozen=True)
class Step:
    """Event or action of a script at time `t`, in seconds after the start."""

    t: float
    item: Event | Action


def read(path: str | os.PathLike[str]) -> list[Step]:
    """Return the steps of a script, sorted by time.

    Raises
    ------
    InputError
        If the file can't be read, or a line is not a valid step.
    """
    lines = text_files.read_text(path, "a script", _MOST_BYTES).splitlines()
    steps = []
    for number, line in enumerate(lines, start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            where = f"{path}:{number}"
            content = text_files.parsed_json(line, f"{where}: step {line.strip()[:60]!r}")
            try:
                steps.append(_step(content))
            except ValueError as error:
                raise InputError(f"{where}: {error}") from None
    return sorted(steps, key=lambda step: step.t)


def _step(content: Any) -> Step:
    if not isinstance(content, dict):
        raise InputError(f"step must be a JSON object, got {content!r}")
    rest = dict(content)
    t = rest.pop("t", 0.0)
    if not isinstance(t, int | float) or not 0 <= t < 1e6:
        raise InputError(f"t must be a time in seconds, at least 0 and less than 1e6, got {t!r}")
    if "do" not in rest:
        event = Event.from_json(rest)
        if event.kind == "resize" and not (event.x >= 1 and event.y >= 1):
            raise InputError(f"window size must be at least 1 x 1, got {event.x:g} x {event.y:g}")
        return Step(float(t), event)
    unknown = set(rest) - {"do", "file", "name"}
    if rest["do"] not in ACTIONS or unknown or not all(isinstance(each, str) for each in rest.values()):
        raise InputError(f'"do" must be one of {", ".join(ACTIONS)}, with a "file" or a "name", got {content!r}')
    action = Action(**rest)
    _check(action)
    return Step(float(t), action)


def _check(action: Action) -> None:
    """Raise InputError for an action that would fail, so that it is reported before the window opens."""
    if action.do == "command" and not is_command(action.name):
        raise InputError(f"unknown command {action.name!r}")
    if action.do == "screenshot":
        if not action.file:
            raise InputError('"file" is missing: a screenshot needs the name of a picture file')
        image.check_writable(action.file)
    if action.do == "save" and action.file:
        saving.check_writable(action.file)


class Player:
    """Playback of steps by their times."""

    def __init__(self, steps: Iterable[Step]) -> None:
        self._steps = list(steps)
        self._next = 0
        self.clock = 0.0  # seconds, by which steps are due
        self._before: float | None = None

    @property
    def over(self) -> bool:
        """True if all steps have been played."""
        return self._next >= len(self._steps)

    @property
    def waits(self) -> bool:
        """True while the clock stands still until the picture is at rest."""
        return self._due_item() == Action("rest")

    def due(self, now: float, *, at_rest: bool) -> list[Step]:
        """Return the steps that are due at `now`, in seconds of any clock; an action is returned alone."""
        if self._before is not None and not self.waits:
            self.clock += now - self._before
        self._before = now
        found: list[Step] = []
        while (item := self._due_item()) is not None:
            if isinstance(item, Action) and (found or (item.do == "rest" and not at_rest)):
                break
            found.append(self._steps[self._next])
            self._next += 1
            if isinstance(item, Action):
                break
        return found

    def _due_item(self) -> Event | Action | None:
        """Return the item of the next step if its time has come, else None."""
        return None if self.over or self._steps[self._next].t > self.clock else self._steps[self._next].item


class Recorder:
    """Recording of events in a script."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        writing.check_writable(path)
        self._path = path
        with self._faults():
            self._file = open(path, "w", encoding="utf-8")  # noqa: SIM115 (closed by `close`)
        self._start: float | None = None

    def add(self, events: Iterable[Event], now: float) -> None:
        """Record the events of a frame."""
        self._start = now if self._start is None else self._start
        for event in events:
            content = {"t": round(now - self._start, 4)} | event.as_json()
            with self._faults():
                self._file.write(json.dumps(content, ensure_ascii=False) + "\n")

    def close(self) -> None:
        """Close the file."""
        with self._faults():
            self._file.close()

    @contextmanager
    def _faults(self) -> Iterator[None]:
        """Raise InputError if the file can't be written."""
        try:
            yield
        except OSError as error:
            raise InputError(f"{self._path}: cannot be written: {writing.reason_of(error)}") from None
