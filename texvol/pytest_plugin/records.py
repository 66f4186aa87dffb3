"""What is kept of a check: plain data, which goes from the process that ran the test to the one that reports.

    test, name, line, file     which test, which picture, and where it is checked
    status                     "same", "different", "broken", "new", "updated" or "refused"
    message                    why, a line each; empty where it passed
    max_error, rms_error       numbers, or None
    kinds                      sentences
    driver, fingerprint        what made the picture
    reference, limits          paths as they are said, the latter of the file
    page, candidate            paths in the report or elsewhere, or None
    entry, outcome             what index and report.json hold, where there is a report

Numbers that are not finite are None.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import pytest

from texvol.util.shown_text import shown

# Worst first.
STATUSES = ("broken", "different", "new", "refused", "updated", "same")
FAILING = frozenset(STATUSES[:4])
Record = dict[str, Any]
RECORDS = pytest.StashKey[list[Record]]()


class PictureError(AssertionError):
    """A picture that is not what it should be; `status` says in which way."""

    def __init__(self, message: str, status: str) -> None:
        super().__init__(shown(message))
        self.status = status


PictureError.__module__ = "texvol.pytest_plugin"  # as short as a line of pytest's summary wants it


def plain(record: Mapping[str, Any]) -> Record:
    """The record in nothing but what JSON has."""
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
    """The records of all tests, in the process that reports, and what else failed."""

    def __init__(self) -> None:
        self._records: dict[tuple[str, str, int], Record] = {}
        self.other_failures = 0
        self.picture_failures: list[str] = []

    def add(self, report: Any) -> None:
        """Take what a report of pytest brings."""
        seen: dict[str, int] = {}
        for record in getattr(report, "texvol_pictures", ()):
            # Of a test that is run again the last time counts.
            number = seen[record["name"]] = seen.get(record["name"], 0) + 1
            self._records[record["test"], record["name"], number] = record
        if report.failed:
            status = getattr(report, "texvol_failure", None)
            if status in ("different", "broken", "new"):
                self.picture_failures.append(status)
            else:
                self.other_failures += 1

    def refuse(self, reasons: Mapping[str, str]) -> None:
        """Pictures that were to be written, and were not: by their claimed name, and why."""
        for record in self._records.values():
            if record["status"] == "updated" and record.get("key") in reasons:
                message = f"{record['reference']} was not written: {reasons[record['key']]}"
                record |= {"status": "refused", "message": [message]}
                if "entry" in record:
                    record["entry"] |= {"status": "broken", "violations": [message]}

    @property
    def records(self) -> list[Record]:
        """Worst first; among equals by how far they are off, then by name."""
        return sorted(self._records.values(), key=_badness)

    def __bool__(self) -> bool:
        return bool(self._records)


def _badness(record: Record) -> tuple[Any, ...]:
    # Where nothing could be measured, or it is infinite, nothing is worse.
    error = record.get("max_error")
    off = float("inf") if error is None else error
    return (STATUSES.index(record["status"]), -off, record["name"], record["test"])


def counted(records: Iterable[Record]) -> str:
    """How many there are of each: "1 different, 3 same"."""
    counts: dict[str, int] = {}
    for record in records:
        counts[record["status"]] = counts.get(record["status"], 0) + 1
    return ", ".join(f"{counts[status]} {status}" for status in STATUSES if status in counts)
