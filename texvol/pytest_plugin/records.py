"""Record of a check: plain data, which pytest sends from the worker to the controller.

    test, name, line, file     test, picture, and position of the check
    status                     "same", "different", "broken", "new", "updated" or "refused"
    message                    reasons, a line each; empty for a passed check
    max_error, rms_error       numbers, or None
    kinds                      sentences
    driver, fingerprint        origin of the picture
    reference, limits          paths of the reference and of the file of limits
    page, candidate            paths in the report or elsewhere, or None
    entry, outcome             parts of the index and of report.json, if there is a report

Numbers that are not finite are None.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pytest

from texvol.util.shown_text import shown

# Worst first.
STATUSES = ("broken", "different", "new", "refused", "updated", "same")
Record = dict[str, Any]
RECORDS = pytest.StashKey[list[Record]]()


class PictureError(AssertionError):
    """A picture failed; `status` is "different", "broken" or "new"."""

    def __init__(self, message: str, status: str) -> None:
        super().__init__(shown(message))
        self.status = status


PictureError.__module__ = "texvol.pytest_plugin"  # a short name for pytest's summary


def plain(record: Mapping[str, Any]) -> Record:
    """Return the record with JSON's types only."""
    import json

    from texvol.comparison.measures import without_infinities

    return dict(json.loads(json.dumps(without_infinities(dict(record)), default=str)))


def attach(report: pytest.TestReport, item: pytest.Item, call: pytest.CallInfo[Any]) -> None:
    """Put the records of a test on its report, which travels between processes."""
    if found := item.stash.get(RECORDS, None):
        vars(report)["texvol_pictures"] = found
        item.stash[RECORDS] = []
    if call.excinfo is not None and isinstance(call.excinfo.value, PictureError):
        vars(report)["texvol_failure"] = call.excinfo.value.status


class Gathered:
    """Records of all tests, in the controller, and the number of other failures."""

    def __init__(self) -> None:
        self._records: dict[tuple[str, str, int], Record] = {}
        self.other_failures = 0
        self.picture_failures: list[str] = []

    def add(self, report: Any) -> None:
        """Add the records of a report of pytest."""
        seen: Counter[str] = Counter()
        for record in getattr(report, "texvol_pictures", ()):
            # The last run of a repeated test counts.
            seen[record["name"]] += 1
            self._records[record["test"], record["name"], seen[record["name"]]] = record
        if report.failed:
            status = getattr(report, "texvol_failure", None)
            if status in ("different", "broken", "new"):
                self.picture_failures.append(status)
            else:
                self.other_failures += 1

    def refuse(self, reasons: Mapping[str, str]) -> None:
        """Mark pictures whose references were not written, with the reason by claimed name."""
        for record in self._records.values():
            if record["status"] == "updated" and record.get("key") in reasons:
                message = f"{record['reference']} was not written: {reasons[record['key']]}"
                record |= {"status": "refused", "message": [message]}
                if "entry" in record:
                    record["entry"] |= {"status": "broken", "violations": [message]}

    @property
    def records(self) -> list[Record]:
        """The records, worst first: by status, error and name."""
        return sorted(self._records.values(), key=_badness)


def _badness(record: Record) -> tuple[Any, ...]:
    # An unknown or infinite error is the worst.
    error = record.get("max_error")
    off = float("inf") if error is None else error
    return (STATUSES.index(record["status"]), -off, record["name"], record["test"])


def counted(records: Iterable[Record]) -> str:
    """Return the number of records of each status: "1 different, 3 same"."""
    counts = Counter(record["status"] for record in records)
    return ", ".join(f"{counts[status]} {status}" for status in STATUSES if status in counts)


def first(lines: Sequence[str], most: int) -> list[str]:
    """Return the first lines, and a line that counts the rest."""
    more = len(lines) - most
    return [*lines[:most], *([f"and {more} more"] if more > 0 else [])]
