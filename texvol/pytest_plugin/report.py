"""Folder of the report: index.html of all pictures, pages/ with a page for each, report.json, summary.md.

Every page ends with a mark, by which a later run recognises and replaces pages of an earlier one. No other file is ever
removed, and a folder that holds other files and no report is refused.
"""

from __future__ import annotations

import json
import os
import shlex
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from texvol.comparison.ci import FAILING
from texvol.comparison.runs.commits import commit_of
from texvol.comparison.runs.stored import FILE, INDEX, MARK, PROGRAM, SUMMARY, stamp
from texvol.pytest_plugin.records import Record, counted
from texvol.util import text_files, writing
from texvol.util.errors import InputError
from texvol.util.version import __version__

if TYPE_CHECKING:
    from texvol.comparison.outcome import Outcome

_MOST_BYTES = 1 << 30


def prepare(folder: Path) -> None:
    """Create the folder, or remove the earlier report in it.

    Raises
    ------
    InputError
        If the folder holds other files, or can't be written to.
    """
    try:
        if folder.exists() and not folder.is_dir():
            raise InputError(f"{folder}: the report needs a folder, got a file")
        if folder.is_dir() and any(folder.iterdir()):
            if not _is_report(folder):
                raise InputError(f"{folder}: the folder must be empty or hold a report of texvol; name another folder")
            index = folder / INDEX
            if index.exists() and not _is_ours(index):
                raise InputError(f"{index}: the page was not written by texvol; name another folder")
            _remove(folder)
        folder.mkdir(parents=True, exist_ok=True)
        # Marks the folder as a report, even if the run is killed.
        writing.write_files({folder / FILE: json.dumps({"program": PROGRAM, "finished": False}).encode()})
    except OSError as error:
        raise InputError(f"{folder}: cannot hold a report: {error.strerror}") from None


def page_of(outcome: Outcome, metadata: Mapping[str, str], index: str | None) -> bytes:
    """Return the content of one picture's page; `index` is the relative path of the report's index."""
    from texvol.comparison.page import comparison_page

    return comparison_page(outcome, metadata=metadata, index=index).encode() + b"\n" + MARK


def entry(record: Record, outcome: Outcome | None, metadata: Mapping[str, str], page: str) -> dict[str, Any]:
    """Return a check's part of the index and of report.json: `entry` and `outcome`."""
    from texvol.comparison.entries import entry_of, entry_without_reference

    test = record["test"]
    if outcome is not None and outcome.candidate is not outcome.reference:
        found = entry_of(outcome, test=test, page=page, metadata=metadata)
        if record["status"] == "updated":
            # The reference is replaced: the picture is the same now.
            found |= {"status": "same", "violations": [], "notes": [*record["message"], *outcome.violations]}
        return {"entry": found, "outcome": outcome.as_json()}
    candidate = outcome.candidate if outcome is not None else None
    status = record["status"] if record["status"] in ("new", "updated") else "broken"
    lines = record["message"] or [record["status"]]
    found = entry_without_reference(
        record["name"], candidate, lines, status="same" if status == "updated" else status, test=test, metadata=metadata
    )
    return {"entry": found}


def finish(folder: Path, records: Sequence[Record], status: int) -> None:
    """Write the files of the whole run.

    Raises
    ------
    InputError
        If a file can't be written.
    """
    from texvol.comparison import ci
    from texvol.comparison.index_page import index_page

    entries = _entries(folder, records)
    tables = [record["self_test"] for record in records if record.get("self_test")]
    page = index_page(
        entries,
        title="Pictures",
        metadata=_common_metadata(records),
        self_test=tables[0] if tables else "",
        accept=shlex.join(["texvol", "accept", _shown_path(folder)]),
    )
    shown = [
        {k: v for k, v in record.items() if k not in ("entry", "self_test")} | _thumbnail(record) for record in records
    ]
    content = {
        "program": PROGRAM,
        "version": __version__,
        "finished": True,
        "time": stamp(time.time()),
        "commit": commit_of(os.environ),
        "exit_status": status,
        "counts": counted(records),
        "pictures": [
            record | {name: _relative(folder, record[name]) for name in ("page", "candidate")} for record in shown
        ],
    }
    files = {
        INDEX: page.encode() + b"\n" + MARK,
        FILE: (json.dumps(content, indent=1, allow_nan=False) + "\n").encode(),
        SUMMARY: ci.job_summary([result_of(record, folder) for record in records]).encode(),
    }
    writing.write_files({folder / name: text for name, text in files.items()})


def _entries(folder: Path, records: Sequence[Record]) -> list[dict[str, Any]]:
    """Return the index's entries, with the names by which `texvol accept` knows those that it can accept."""
    from texvol.pytest_plugin.accepting import ids_of

    ids = ids_of([record | {"candidate": _relative(folder, record["candidate"])} for record in records])
    return [
        record["entry"] | {"accept": "" if record.get("not_accepted") else ids.get(number, "")}
        for number, record in enumerate(records)
        if "entry" in record
    ]


def _shown_path(folder: Path) -> str:
    """Return the folder as seen from the current one, if it is in it."""
    relative = os.path.relpath(folder)
    return str(folder) if relative.startswith("..") else relative


def _thumbnail(record: Record) -> dict[str, str]:
    """Return the thumbnail of a failed picture, for a report of several runs: the difference, or the candidate."""
    thumbnails = record.get("entry", {}).get("thumbnails", {})
    found = thumbnails.get("difference") or thumbnails.get("candidate")
    return {"thumbnail": found} if found and record["status"] in FAILING else {}


def result_of(record: Record, folder: Path | None = None) -> Any:
    """Return the result of a record, for a CI system."""
    from texvol.comparison.ci import Result

    page = record.get("page")
    return Result(
        name=record["name"],
        status=record["status"],
        words=tuple(record["message"]),
        kinds=tuple(record["kinds"]),
        max_error=record["max_error"],
        rms_error=record["rms_error"],
        file=record["file"],
        line=record["line"],
        page=_relative(folder, page) if folder else page,
        attachments=tuple(path for path in (record.get("candidate"), page) if path),
    )


def _common_metadata(records: Sequence[Record]) -> dict[str, str]:
    """Return the metadata that the fingerprints of all pictures agree on."""
    fingerprints = [record["fingerprint"] for record in records if record["fingerprint"]]
    first = fingerprints[0] if fingerprints else {"texvol": __version__}
    return {name: fact for name, fact in first.items() if all(each.get(name) == fact for each in fingerprints)}


def _relative(folder: Path, path: str | None) -> str | None:
    """Return a path in the folder relative to the folder, and other paths as they are."""
    return Path(path).relative_to(folder).as_posix() if path and Path(path).is_relative_to(folder) else path


def _is_report(folder: Path) -> bool:
    try:
        text = text_files.read_text(folder / FILE, "JSON", _MOST_BYTES)
        content = text_files.parsed_json(text, FILE)
    except InputError:
        return False
    return isinstance(content, dict) and content.get("program") == PROGRAM


def _remove(folder: Path) -> None:
    """Remove an earlier run's files, and folders that become empty."""
    pages = [path for path in (folder / "pages").rglob("*.html") if not path.is_symlink() and _is_ours(path)]
    candidates = [path for path in (folder / "pages").rglob("*.exr") if _is_candidate(path)]
    for path in [*pages, *candidates, *(folder / name for name in (INDEX, FILE, SUMMARY))]:
        path.unlink(missing_ok=True)
    for path in sorted((folder / "pages").rglob("*"), reverse=True):
        if path.is_dir() and not path.is_symlink() and not any(path.iterdir()):
            path.rmdir()


def _is_ours(path: Path) -> bool:
    return path.read_bytes().endswith(MARK)


def _is_candidate(path: Path) -> bool:
    """True if the file is a candidate of this plugin: an EXR with a fingerprint in its header."""
    with path.open("rb") as file:
        return b"texvol:fingerprint" in file.read(1 << 20)
