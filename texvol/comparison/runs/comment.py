"""Comment for a pull request, in Markdown: counts of each run, the worst pictures, and where the pages are.

It begins with a mark, by which a bot finds and replaces its earlier comment.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from texvol.comparison.ci import FAILING, SIGNS, cell
from texvol.comparison.runs.rows import Row, counts_of
from texvol.comparison.runs.stored import Run
from texvol.util.errors import InputError
from texvol.util.shown_text import markdown

MARK = "<!-- texvol pictures -->"
_MOST_PICTURES = 10
_ADDRESS = re.compile(r"https?://[^\s()<>\"'\\]+")


def artifact_words(given: str | None) -> str:
    """Return Markdown for an artifact NAME or NAME=ADDRESS; InputError if the address is not one of the web."""
    if not given:
        return ""
    name, separator, address = given.partition("=")
    if not name.strip() or (separator and not _ADDRESS.fullmatch(address)):
        raise InputError(f"--artifact must be NAME or NAME=https://ADDRESS, got {given!r}")
    return f"[{markdown(name)}]({address})" if separator else f"**{markdown(name)}**"


def comment(runs: Sequence[Run], rows: Sequence[Row], artifact: str | None = None) -> str:
    """Return the comment; `rows` are worst first, `artifact` is as for `artifact_words`."""
    failed = [row for row in rows if row.failed]
    where = artifact_words(artifact)
    lines = [MARK, f"### Pictures: {_headline(runs, rows, failed)}", "", "| run | pictures |", "|---|---|"]
    for run, state in zip(runs, counts_of(runs, rows), strict=True):
        lines.append(
            f"| {SIGNS['different' if run.failed or not run.is_finished else 'same']} {cell(run.name)} | {state} |"
        )
    if failed:
        lines += ["", "| picture | failed in | what | max | rms |", "|---|---|---|---:|---:|"]
        lines += [_row(row, runs) for row in failed[:_MOST_PICTURES]]
        lines += ["", f"and {len(failed) - _MOST_PICTURES} more"] if len(failed) > _MOST_PICTURES else []
    if where:
        lines += ["", f"All pictures: artifact {where}, file `index.html`."]
    lines += _missing(runs, rows) + _commands(runs)
    return "\n".join(lines) + "\n"


def _headline(runs: Sequence[Run], rows: Sequence[Row], failed: Sequence[Row]) -> str:
    of = f" in {len(runs)} runs" if len(runs) > 1 else ""
    if not rows:
        return f"none were compared{of}"
    return f"{len(failed)} of {len(rows)} failed{of}" if failed else f"all {len(rows)} fine{of}"


def _row(row: Row, runs: Sequence[Run]) -> str:
    worst = row.worst
    where = ", ".join(
        f"{SIGNS[record['status']]} {cell(run.name)}: {record['status']}"
        for run, record in zip(runs, row.records, strict=True)
        if record is not None and row.has_failed(record)
    )
    what = "; ".join(worst["kinds"] or worst["message"][1:] or worst["message"])
    numbers = ["" if worst.get(key) is None else f"{worst[key]:.3g}" for key in ("max_error", "rms_error")]
    return f"| {' | '.join((cell(row.name), where, cell(what), *numbers))} |"


def _missing(runs: Sequence[Run], rows: Sequence[Row]) -> list[str]:
    """Return lines on the pictures that a run did not check: its test may have ended before, or is not of that run."""
    lines = []
    for column, run in enumerate(runs):
        names = [row.name for row in rows if row.records[column] is None]
        if names:
            more = f" and {len(names) - _MOST_PICTURES} more" if len(names) > _MOST_PICTURES else ""
            lines += ["", f"Not checked in {cell(run.name)}: {', '.join(map(cell, names[:_MOST_PICTURES]))}{more}."]
    return lines


def _commands(runs: Sequence[Run]) -> list[str]:
    """Return a line for each run with the command that accepts its candidates, in the folder of the merged report."""
    lines = []
    for run in runs:
        taken = [each for each in run.pictures if each["status"] in FAILING and each.get("candidate")]
        names = dict.fromkeys(each["name"] for each in taken if not each.get("not_accepted"))
        if names:
            shown = _plain(" ".join(list(names)[:_MOST_PICTURES]))
            lines.append(f"- {cell(run.name)}: `texvol accept DIR/runs/{_plain(run.name)} {shown}`")
    told = "What is right is accepted, in the project's folder, where DIR is this artifact's folder, by"
    return ["", told, "", *lines] if lines else []


def _plain(names: str) -> str:
    """Return names of pictures for code in Markdown; of other characters than names have nothing is left."""
    return re.sub(r"[^A-Za-z0-9_./ \-]", "", names)
