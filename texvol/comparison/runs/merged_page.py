"""HTML page of several runs: a row for each picture, a column for each run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from texvol.comparison.runs.rows import Row, counts_of
from texvol.comparison.runs.stored import INDEX, STATUSES, Run, thumbnail_of
from texvol.comparison.templates import rendered

RUNS = "runs"  # folder of the runs' own reports
_MOST_WORDS = 4


def merged_page(runs: Sequence[Run], rows: Sequence[Row], files: set[str]) -> str:
    """Return the page's HTML; `files` are the paths of the merged report's files, which links may lead to."""
    failed = [row for row in rows if row.failed]
    heads = [
        {
            "name": run.name,
            "index": index if (index := f"{RUNS}/{run.name}/{INDEX}") in files else "",
            "counts": counts,
            "metadata": run.metadata,
        }
        for run, counts in zip(runs, counts_of(runs, rows), strict=True)
    ]
    passed = [row for row in rows if not row.failed]
    return rendered(
        "merged.html",
        title=f"{len(failed)} failed: Pictures of {len(runs)} runs" if failed else f"Pictures of {len(runs)} runs",
        runs=heads,
        failed=[_shown(row, runs, files) for row in failed],
        missing=[_shown(row, runs, files) for row in passed if not row.is_everywhere],
        passed=[_shown(row, runs, files) for row in passed if row.is_everywhere],
        total=len(rows),
    )


def _shown(row: Row, runs: Sequence[Run], files: set[str]) -> dict[str, Any]:
    """Return a row as the page shows it."""
    cells: list[dict[str, Any] | None] = []
    for run, record in zip(runs, row.records, strict=True):
        if record is None:
            cells.append(None)
            continue
        page = f"{RUNS}/{run.name}/{record.get('page')}"
        cells.append(
            {
                **{key: record.get(key) for key in ("status", "max_error", "rms_error")},
                "page": page if page in files else "",
                "thumbnail": thumbnail_of(record),
            }
        )
    words = dict.fromkeys(
        line for each in row.known if row.has_failed(each) for line in each["kinds"] or each["message"]
    )
    return {
        "name": row.name,
        "test": row.test,
        "cells": cells,
        "words": list(words)[:_MOST_WORDS],
        "summary": _summary(row, runs),
    }


def _summary(row: Row, runs: Sequence[Run]) -> str:
    """Return in which runs the picture has which status: "different in mac; same in linux, windows"."""
    by_status: dict[str, list[str]] = {}
    for run, record in zip(runs, row.records, strict=True):
        by_status.setdefault(record["status"] if record is not None else "not checked", []).append(run.name)
    order = (*STATUSES, "not checked")
    return "; ".join(f"{status} in {', '.join(by_status[status])}" for status in order if status in by_status)
