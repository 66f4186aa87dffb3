"""History: runs in time, in a file that each run is added to, so that no earlier report has to be kept.

The folder holds history.json, which a CI system keeps from run to run, and index.html. Runs that have the same name are
a series; runs on several systems have several. A run that is added again, as a job that is run twice, is replaced.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from texvol.comparison.runs.stored import INDEX, STATUSES, Run, checked_commit, thumbnail_of, utc
from texvol.util import text_files, writing
from texvol.util.errors import InputError
from texvol.util.version import __version__

HISTORY = "history.json"
_PROGRAM = "texvol history of pictures"
_MOST_BYTES = 1 << 30
_NUMBERS = ("max_error", "rms_error")

Key = tuple[str, str]  # name of a picture, and its test


@dataclass(frozen=True)
class Past:
    """One run of a history.

    Attributes
    ----------
    series : str
        Name of the run.
    time, commit : str
        As of a `Run`.
    pictures : mapping
        By name and test: `status`, `max_error`, `rms_error`, and `thumbnail` of a picture that failed.
    """

    series: str
    time: str
    commit: str
    is_finished: bool
    pictures: Mapping[Key, Mapping[str, Any]]

    @classmethod
    def of(cls, run: Run) -> Past:
        """Return a run, with what a history keeps of it; of checks of one picture in one test the worst counts."""
        pictures: dict[Key, Mapping[str, Any]] = {}
        for record in sorted(run.pictures, key=lambda each: STATUSES.index(each["status"]), reverse=True):
            kept = {name: record.get(name) for name in ("status", *_NUMBERS)}
            thumbnail = thumbnail_of(record)
            pictures[record["name"], record["test"]] = kept | ({"thumbnail": thumbnail} if thumbnail else {})
        return cls(run.name, run.time, run.commit, run.is_finished, pictures)

    def as_json(self) -> dict[str, Any]:
        """Return the run in JSON types."""
        listed = [{"name": name, "test": test} | dict(found) for (name, test), found in self.pictures.items()]
        head = {"series": self.series, "time": self.time, "commit": self.commit, "finished": self.is_finished}
        return head | {"pictures": listed}


def extended(earlier: Sequence[Past], runs: Sequence[Run], kept: int) -> list[Past]:
    """Return the runs of a history and further ones, the oldest first, and of each series the last `kept`."""
    found = {(each.series, each.time, each.commit): each for each in (*earlier, *map(Past.of, runs))}
    ordered = sorted(found.values(), key=lambda each: (each.series, each.time))
    return [
        each
        for series in dict.fromkeys(past.series for past in ordered)
        for each in [past for past in ordered if past.series == series][-kept:]
    ]


def read(folder: str | os.PathLike[str]) -> list[Past]:
    """Return the runs of a history's folder; none of a new or empty folder.

    Raises
    ------
    InputError
        If the folder holds other files and no history, or the history is not valid.
    """
    place = Path(folder)
    if not os.path.lexists(place):
        return []
    if not place.is_dir():
        raise InputError(f"{folder}: the history needs a folder, got a file")
    file = place / HISTORY
    if not os.path.lexists(file):
        if any(place.iterdir()):
            raise InputError(f"{folder}: the folder must be empty or hold {HISTORY}; name another folder")
        return []
    content = text_files.parsed_json(text_files.read_text(file, "JSON", _MOST_BYTES), str(file))
    if not isinstance(content, dict) or content.get("program") != _PROGRAM or not isinstance(content.get("runs"), list):
        raise InputError(f"{file}: must be a history of texvol, got another file")
    return [_past(each, file) for each in content["runs"]]


def write(folder: str | os.PathLike[str], past: Sequence[Past], page: str) -> Path:
    """Write the history and its page (HTML), and return the page's path; InputError if they can't be written."""
    place = Path(folder)
    content = {"program": _PROGRAM, "version": __version__, "runs": [each.as_json() for each in past]}
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{error.filename}: cannot be written: {error.strerror}") from None
    text = json.dumps(content, separators=(",", ":"), allow_nan=False) + "\n"
    writing.write_files({place / HISTORY: text.encode(), place / INDEX: page.encode()})
    return place / INDEX


def _past(found: object, file: Path) -> Past:
    """Return a run of a file; InputError if it lacks what readers use."""
    if not isinstance(found, dict) or not isinstance(found.get("series"), str):
        raise InputError(f"{file}: a run must be an object with the text 'series', got {found!r:.80}")
    listed = found.get("pictures")
    if not isinstance(listed, list):
        raise InputError(f"{file}: pictures of a run must be a list, got {type(listed).__name__}")
    pictures = {}
    for each in listed:
        if not isinstance(each, dict) or not all(isinstance(each.get(name), str) for name in ("name", "test")):
            raise InputError(f"{file}: a picture must be an object with the texts 'name' and 'test', got {each!r:.80}")
        if each.get("status") not in STATUSES:
            raise InputError(f"{file}: status must be one of {', '.join(STATUSES)}, got {each.get('status')!r:.80}")
        for name in _NUMBERS:
            if each.get(name) is not None and type(each[name]) not in (int, float):
                raise InputError(f"{file}: {name} of a picture must be a number, got {each[name]!r:.80}")
        kept = {name: each.get(name) for name in ("status", *_NUMBERS)}
        thumbnail = thumbnail_of(each)
        pictures[each["name"], each["test"]] = kept | ({"thumbnail": thumbnail} if thumbnail else {})
    time, commit = utc(found.get("time"), file), checked_commit(found.get("commit", ""), file)
    return Past(found["series"], time, commit, found.get("finished") is True, pictures)
