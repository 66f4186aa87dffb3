"""Changes: what became of each picture from run to run of one series."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from texvol.comparison.ci import FAILING
from texvol.comparison.runs.history import Key, Past
from texvol.comparison.runs.stored import STATUSES

# Relative difference of two errors that is a change. Sums in another order change the last digits of float32 only; a
# change that is worth a look changes more than one part in a hundred.
_CHANGE = 0.01

Found = Mapping[str, Any]


@dataclass(frozen=True)
class Change:
    """State of a picture from one run on; `found` is None if the picture was not checked."""

    run: Past
    found: Found | None
    runs: int  # number of runs that it lasted


@dataclass(frozen=True)
class Story:
    """History of one picture.

    Attributes
    ----------
    points : tuple
        State in each run of the series, the oldest first; None where it was not checked.
    changes : tuple of Change
        The latest first; the first run counts as a change.
    note : str
        Beginning, end or other name of the picture; empty if there is nothing to say.
    """

    name: str
    test: str
    points: tuple[Found | None, ...]
    changes: tuple[Change, ...]
    note: str

    @property
    def latest(self) -> Found | None:
        return self.points[-1]

    @property
    def failed(self) -> bool:
        return self.latest is not None and self.latest["status"] in FAILING


def stories(runs: Sequence[Past]) -> list[Story]:
    """Return the history of each picture of a series: those that fail first, then the latest change first."""
    keys = list(dict.fromkeys(key for run in runs for key in run.pictures))
    spans = {key: _span(key, runs) for key in keys}
    found = [_story(key, runs, spans) for key in keys]
    return sorted(found, key=lambda each: _order(each, runs))


def differs(one: Found | None, other: Found | None) -> bool:
    """True if a picture's state changed."""
    if one is None or other is None:
        return one is not other
    if one["status"] != other["status"]:
        return True
    for name in ("max_error", "rms_error"):
        a, b = one[name], other[name]
        if (a is None) != (b is None) or (a is not None and abs(a - b) > _CHANGE * max(abs(a), abs(b))):
            return True
    return False


def _story(key: Key, runs: Sequence[Past], spans: Mapping[Key, tuple[int, int]]) -> Story:
    points = tuple(run.pictures.get(key) for run in runs)
    changes: list[Change] = []
    begins = spans[key][0]  # before its first run there is no picture
    since = begins
    for index in range(begins, len(runs)):
        # A run that did not finish says nothing of the pictures that it lacks.
        is_silent = points[index] is None and not runs[index].is_finished
        if index > begins and not is_silent and differs(points[since], points[index]):
            changes.append(Change(runs[since], points[since], index - since))
            since = index
    changes.append(Change(runs[since], points[since], len(runs) - since))
    return Story(*key, points, tuple(changes[::-1]), _note(key, runs, spans))


def _span(key: Key, runs: Sequence[Past]) -> tuple[int, int]:
    """Return the numbers of the first and the last run that checked a picture."""
    numbers = [number for number, run in enumerate(runs) if key in run.pictures]
    return numbers[0], numbers[-1]


def _note(key: Key, runs: Sequence[Past], spans: Mapping[Key, tuple[int, int]]) -> str:
    """Return what is to say of the beginning and the end of a picture.

    A picture that begins in the run in which another one is missing for the first time, of the same name or the same
    test, probably is that picture under another name.
    """
    first, last = spans[key]
    words = []
    before = [other for other, (_, end) in spans.items() if end == first - 1 and _is_akin(key, other)]
    after = [other for other, (begin, _) in spans.items() if begin == last + 1 and _is_akin(key, other)]
    if len(before) == 1:
        words.append(f"probably {_called(before[0], key)} until then")
    if last < len(runs) - 1:
        then = f", then probably {_called(after[0], key)}" if len(after) == 1 else ""
        words.append(f"last checked {_day(runs[last])}{then}")
    elif first and not before:
        words.append(f"first checked {_day(runs[first])}")
    return "; ".join(words)


def _is_akin(one: Key, other: Key) -> bool:
    return one != other and (one[0] == other[0] or one[1] == other[1])


def _called(other: Key, key: Key) -> str:
    """Return the part of a picture's name and test that differs from another one's."""
    return f"in {other[1]}" if other[0] == key[0] else f"'{other[0]}'"


def _day(run: Past) -> str:
    return run.time[:10]


def _order(story: Story, runs: Sequence[Past]) -> tuple[Any, ...]:
    changed = -runs.index(story.changes[0].run)
    badness = STATUSES.index(story.latest["status"]) if story.latest is not None else len(STATUSES)
    return not story.failed, changed, badness, story.name, story.test
