"""One report of several runs: a page with a row for each picture and a column for each run.

The folder holds index.html, report.json, comment.md, and in runs/NAME the report of each run, with its pages: it is
complete, and `texvol accept` takes any of runs/NAME. A later merge replaces the files of an earlier one and no others.
"""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from texvol.comparison.runs.comment import comment
from texvol.comparison.runs.merged_page import RUNS, merged_page
from texvol.comparison.runs.rows import Row, rows_of
from texvol.comparison.runs.stored import FILE, INDEX, SUMMARY, Run, counted
from texvol.util import text_files, writing
from texvol.util.errors import InputError
from texvol.util.version import __version__

_PROGRAM = "texvol merged pictures"
COMMENT = "comment.md"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.\-]{0,99}")
_MOST_BYTES = 1 << 30


def named_runs(given: Sequence[str], *, one_each: bool = True) -> list[Run]:
    """Read the reports of folders, given as DIR or NAME=DIR.

    Parameters
    ----------
    one_each : bool
        True if names must differ.

    Raises
    ------
    InputError
        If a folder holds no report, or the names are not valid or not different.
    """
    runs = []
    for text in given:
        name, separator, folder = text.partition("=")
        if not separator or os.path.isdir(text):
            name, folder = "", text
        run = Run.read(folder, name)
        if not _NAME.fullmatch(run.name):
            raise InputError(
                f"name of a run must be of letters, digits, - _ and ., got {run.name!r}; give NAME=DIR for {folder}"
            )
        runs.append(run)
    twice = [name for name, count in Counter(run.name.lower() for run in runs).items() if count > 1]
    if twice and one_each:
        raise InputError(f"names of runs must differ, got {twice[0]!r} twice; give NAME=DIR")
    return runs


def merge(runs: Sequence[Run], folder: str | os.PathLike[str], artifact: str | None = None) -> Path:
    """Write the merged report and return the path of its page.

    Raises
    ------
    InputError
        If the folder holds other files, can't be written, or is the folder of a run.
    """
    place, rows = Path(folder), rows_of(runs)
    words = comment(runs, rows, artifact)
    _check_apart(place, runs)
    earlier = _earlier(place)
    files = {f"{RUNS}/{run.name}/{name}": path for run in runs for name, path in _files_of(run).items()}
    contents = {name: path.read_bytes() for name, path in files.items()}
    own = (INDEX, COMMENT, FILE)
    contents |= {INDEX: merged_page(runs, rows, set(files)).encode(), COMMENT: words.encode()}
    contents[FILE] = _described(runs, rows, sorted({*files, *own}))
    try:
        for name in earlier - set(contents):
            (place / name).unlink(missing_ok=True)
        for name in contents:
            (place / name).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{error.filename}: cannot be written: {error.strerror}") from None
    writing.write_files({place / name: content for name, content in contents.items()})
    return place / INDEX


def _described(runs: Sequence[Run], rows: Sequence[Row], files: list[str]) -> bytes:
    content = {
        "program": _PROGRAM,
        "version": __version__,
        "runs": [{"name": run.name, "counts": counted(run.pictures), "finished": run.is_finished} for run in runs],
        "pictures": [
            {
                "name": row.name,
                "test": row.test,
                "runs": {
                    run.name: {key: record.get(key) for key in ("status", "max_error", "rms_error")}
                    for run, record in zip(runs, row.records, strict=True)
                    if record is not None
                },
            }
            for row in rows
        ],
        "files": files,
    }
    return (json.dumps(content, indent=1) + "\n").encode()


def _check_apart(folder: Path, runs: Sequence[Run]) -> None:
    """Raise InputError if the folder is, or is in, the folder of a run."""
    place = Path(os.path.realpath(folder))
    for run in runs:
        other = Path(os.path.realpath(run.folder))
        if other == place or other in place.parents:
            raise InputError(f"{folder}: the merged report must be outside of the reports that are merged")


def _earlier(folder: Path) -> set[str]:
    """Return the files of an earlier merge in the folder; none of a new or empty one."""
    if not os.path.lexists(folder):
        return set()
    if not folder.is_dir():
        raise InputError(f"{folder}: the merged report needs a folder, got a file")
    if not any(folder.iterdir()):
        return set()
    try:
        content = text_files.parsed_json(text_files.read_text(folder / FILE, "JSON", _MOST_BYTES), FILE)
    except InputError:
        content = None
    if not isinstance(content, dict) or content.get("program") != _PROGRAM:
        raise InputError(f"{folder}: the folder must be empty or hold a merged report of texvol; name another folder")
    names = [each for each in content.get("files", []) if isinstance(each, str)]
    root = os.path.realpath(folder)
    return {each for each in names if os.path.realpath(folder / each).startswith(root + os.sep)}


def _files_of(run: Run) -> dict[str, Path]:
    """Return the files of a run's report by their paths in it: only those that the report names."""
    named = [record.get(key) for record in run.pictures for key in ("page", "candidate")]
    found = {name: run.path(name) for name in (INDEX, FILE, SUMMARY, *named) if isinstance(name, str)}
    return {PurePosixPath(name).as_posix(): path for name, path in found.items() if path is not None}
