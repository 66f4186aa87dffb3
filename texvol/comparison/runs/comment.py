"""Comment for a pull request, in Markdown: counts of each run, the worst pictures, and where the pages are.

It begins with a mark, by which a bot finds and replaces its earlier comment.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from texvol.comparison.ci import SIGNS, cell
from texvol.comparison.runs.rows import Row
from texvol.comparison.runs.stored import Run, counted
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
    for run in runs:
        state = counted(run.pictures) + ("" if run.is_finished else "; the run did not finish")
        lines.append(
            f"| {SIGNS['different' if run.failed or not run.is_finished else 'same']} {cell(run.name)} | {state} |"
        )
    if failed:
        lines += ["", "| picture | failed in | what | max | rms |", "|---|---|---|---:|---:|"]
        lines += [_row(row, runs) for row in failed[:_MOST_PICTURES]]
        lines += ["", f"and {len(failed) - _MOST_PICTURES} more"] if len(failed) > _MOST_PICTURES else []
    if where:
        lines += ["", f"All pictures: artifact {where}, file `index.html`."]
    if names := [row.name for row in failed if any(each.get("candidate") for each in row.known)][:_MOST_PICTURES]:
        command = f"texvol accept DIR {_plain(' '.join(dict.fromkeys(names)))}"
        lines += ["", f"What is right is accepted by `{command}`, where DIR is the folder of a run's report."]
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


def _plain(names: str) -> str:
    """Return names of pictures for code in Markdown; of other characters than names have nothing is left."""
    return re.sub(r"[^A-Za-z0-9_./ \-]", "", names)
