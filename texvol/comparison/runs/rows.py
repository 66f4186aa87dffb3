"""Pictures of several runs: the records of one picture beside each other, worst first."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from texvol.comparison.ci import FAILING
from texvol.comparison.runs.stored import STATUSES, Run, counted

Record = Mapping[str, Any]


@dataclass(frozen=True)
class Row:
    """A picture of a test, with its record in each run; None where the run did not check it."""

    name: str
    test: str
    records: tuple[Record | None, ...]

    @staticmethod
    def has_failed(record: Record) -> bool:
        return record["status"] in FAILING

    @property
    def known(self) -> list[Record]:
        return [each for each in self.records if each is not None]

    @property
    def worst(self) -> Record:
        """The record of the worst status, and of these the largest error; an unknown error is the largest."""
        return min(self.known, key=lambda each: (STATUSES.index(each["status"]), -_error(each)))

    @property
    def is_everywhere(self) -> bool:
        """True if all runs checked the picture."""
        return None not in self.records

    @property
    def failed(self) -> bool:
        return any(map(self.has_failed, self.known))


def rows_of(runs: Sequence[Run]) -> list[Row]:
    """Return a row for each picture, worst first."""
    found: dict[tuple[str, str, int], list[Record | None]] = {}
    for column, run in enumerate(runs):
        seen: Counter[tuple[str, str]] = Counter()
        for record in run.pictures:
            key = record["name"], record["test"]
            seen[key] += 1
            found.setdefault((*key, seen[key]), [None] * len(runs))[column] = record
    rows = [Row(name, test, tuple(records)) for (name, test, _), records in found.items()]
    return sorted(rows, key=_badness)


def counts_of(runs: Sequence[Run], rows: Sequence[Row]) -> list[str]:
    """Return the counts of each run in words; a picture of another run that a run did not check is counted as well."""
    words = []
    for column, run in enumerate(runs):
        missing = sum(row.records[column] is None for row in rows)
        parts = [counted(run.pictures), f"{missing} not checked" if missing else ""]
        unfinished = "" if run.is_finished else "; the run did not finish"
        words.append(", ".join(filter(None, parts)) + unfinished)
    return words


def _badness(row: Row) -> tuple[Any, ...]:
    failed = sum(map(row.has_failed, row.known))
    return STATUSES.index(row.worst["status"]), -failed, -_error(row.worst), row.name, row.test


def _error(record: Record) -> float:
    error = record.get("max_error")
    return float("inf") if error is None else float(error)
