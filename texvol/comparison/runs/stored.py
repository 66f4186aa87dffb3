"""Report of one run, read from its folder: checked, since it may come from another machine.

Paths in the report are those of files in the folder: no path leads out of it, also not by a link.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import Any

from texvol.comparison.ci import FAILING
from texvol.util import text_files
from texvol.util.errors import InputError

FILE, INDEX, SUMMARY = "report.json", "index.html", "summary.md"
PROGRAM = "texvol pictures"
MARK = b"<!-- written by pytest --texvol-report -->\n"  # end of the report's pages
# Worst first.
STATUSES = ("broken", "different", "new", "refused", "updated", "same")
_MOST_BYTES = 1 << 30
_THUMBNAIL = re.compile(r"data:image/(png|jpeg);base64,[A-Za-z0-9+/=]+")
_COMMIT = re.compile(r"[A-Za-z0-9]{4,64}")
_TEXTS = ("name", "test", "reference")


@dataclass(frozen=True)
class Run:
    """Report of one run.

    Attributes
    ----------
    pictures : tuple of mapping
        Records, see texvol/pytest_plugin/records.py.
    time : str
        End of the run, UTC, such as 2026-01-31T12:00:00+00:00; of reports without it, the time of the file.
    commit : str
        Commit of the tested source; empty if unknown.
    """

    name: str
    folder: Path
    pictures: tuple[Mapping[str, Any], ...]
    is_finished: bool
    time: str
    commit: str = ""

    @classmethod
    def read(cls, folder: str | os.PathLike[str], name: str = "") -> Run:
        """Read the report of a folder; its name is the folder's if none is given.

        Raises
        ------
        InputError
            If the folder holds no report, or the report is not valid.
        """
        place = Path(folder)
        if not place.is_dir():
            raise InputError(f"{folder}: must be the folder of a report (pytest --texvol-report), got no folder")
        file = place / FILE
        if not os.path.lexists(file):
            raise InputError(f"{folder}: must be the folder of a report (pytest --texvol-report), has no {FILE}")
        content = text_files.parsed_json(text_files.read_text(file, "JSON", _MOST_BYTES), str(file))
        if not isinstance(content, dict) or content.get("program") != PROGRAM:
            raise InputError(f"{file}: must be a report of pytest --texvol-report, got another file")
        pictures = content.get("pictures", [])
        if not isinstance(pictures, list):
            raise InputError(f"{file}: pictures must be a list, got {type(pictures).__name__}")
        for each in pictures:
            _check(each, file)
        name = name or Path(os.path.abspath(place)).name
        time = utc(content["time"], file) if "time" in content else stamp(file.stat().st_mtime)
        commit = checked_commit(content.get("commit", ""), file)
        return cls(name, place, tuple(pictures), content.get("finished") is True, time, commit)

    def path(self, text: object) -> Path | None:
        """Return the file that a record names by its path in the report; None if there is none in the folder."""
        if not isinstance(text, str) or not text or PurePosixPath(text).is_absolute() or ".." in Path(text).parts:
            return None
        root = os.path.realpath(self.folder)
        found = os.path.realpath(self.folder / text)
        return Path(found) if found.startswith(root + os.sep) and os.path.isfile(found) else None

    @property
    def metadata(self) -> dict[str, str]:
        """Fingerprint of the pictures, as far as all pictures agree."""
        fingerprints = [each["fingerprint"] for each in self.pictures if each.get("fingerprint")]
        first = fingerprints[0] if fingerprints else {}
        return {
            str(key): str(fact) for key, fact in first.items() if all(each.get(key) == fact for each in fingerprints)
        }

    @property
    def failed(self) -> int:
        """Number of pictures that failed."""
        return sum(each["status"] in FAILING for each in self.pictures)


def stamp(seconds: float) -> str:
    """Return a time, in seconds since 1970, as text in UTC, to the second."""
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="seconds")


def utc(text: object, file: Path) -> str:
    """Return a time of a file in UTC; InputError if it is none."""
    try:
        found = datetime.fromisoformat(text if isinstance(text, str) else "")
        return found.astimezone(UTC).isoformat(timespec="seconds")
    except (ValueError, OverflowError):
        raise InputError(f"{file}: time must be one such as 2026-01-31T12:00:00+00:00, got {text!r}") from None


def checked_commit(text: object, file: Path) -> str:
    """Return a commit of a file, or empty text; InputError if it is none."""
    if text == "" or (isinstance(text, str) and _COMMIT.fullmatch(text)):
        return text
    raise InputError(f"{file}: commit must be 4 to 64 letters and digits, got {text!r}")


def thumbnail_of(record: Mapping[str, Any]) -> str:
    """Return the thumbnail of a record as a data URL; empty without a valid one."""
    thumbnail = record.get("thumbnail")
    return thumbnail if isinstance(thumbnail, str) and _THUMBNAIL.fullmatch(thumbnail) else ""


def counted(pictures: Sequence[Mapping[str, Any]]) -> str:
    """Return the number of pictures of each status, worst first: "1 different, 3 same"; "none" without pictures."""
    counts = Counter(each["status"] for each in pictures)
    return ", ".join(f"{counts[status]} {status}" for status in STATUSES if counts[status]) or "none"


def _check(record: object, file: Path) -> None:
    """Raise InputError if a record lacks what readers use."""
    if not isinstance(record, dict):
        raise InputError(f"{file}: a picture must be an object, got {type(record).__name__}")
    for key in _TEXTS:
        if not isinstance(record.get(key), str):
            raise InputError(f"{file}: {key} of a picture must be a text, got {record.get(key)!r}")
    if record.get("status") not in STATUSES:
        raise InputError(f"{file}: status must be one of {', '.join(STATUSES)}, got {record.get('status')!r}")
    for key in ("max_error", "rms_error"):
        if record.get(key) is not None and not isinstance(record[key], int | float):
            raise InputError(f"{file}: {key} of a picture must be a number, got {record[key]!r}")
    for key in ("message", "kinds"):
        lines = record.setdefault(key, [])
        if not isinstance(lines, list) or not all(isinstance(each, str) for each in lines):
            raise InputError(f"{file}: {key} of a picture must be a list of texts, got {lines!r}")
    if not isinstance(record.setdefault("fingerprint", {}), dict):
        raise InputError(f"{file}: fingerprint of a picture must be an object, got {record['fingerprint']!r}")
