"""HTML page of a history: of each picture a chart of its error over the runs, and its changes with date and commit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from texvol.comparison.ci import FAILING
from texvol.comparison.runs.changes import Change, Story, stories
from texvol.comparison.runs.history import Past
from texvol.comparison.runs.stored import counted
from texvol.comparison.templates import kind_of_status, rendered

_WIDTH, _HEIGHT, _MARGIN = 180.0, 40.0, 4.0  # of a chart
_COMMIT_LETTERS = 10  # enough to find a commit by


def history_page(past: Sequence[Past]) -> str:
    """Return the page's HTML."""
    series = []
    for name in dict.fromkeys(each.series for each in past):
        runs = [each for each in past if each.series == name]
        found = stories(runs)
        failed = [each for each in found if each.failed]
        series.append(
            {
                "name": name,
                "runs": len(runs),
                "first": _when(runs[0]),
                "latest": _when(runs[-1]),
                "counts": counted(list(runs[-1].pictures.values())),
                "finished": runs[-1].is_finished,
                "failed": [_shown(each, runs) for each in failed],
                "others": [_shown(each, runs) for each in found if not each.failed],
            }
        )
    failures = sum(len(each["failed"]) for each in series)  # type: ignore[misc, arg-type]
    title = f"{failures} failed: History of pictures" if failures else "History of pictures"
    return rendered("history.html", title=title, series=series, width=_WIDTH, height=_HEIGHT)


def _when(run: Past) -> dict[str, str]:
    return {"time": run.time[:16].replace("T", " ") + " UTC", "commit": run.commit[:_COMMIT_LETTERS]}


def _shown(story: Story, runs: Sequence[Past]) -> dict[str, Any]:
    """Return a picture's history as the page shows it."""
    return {
        "name": story.name,
        "test": story.test,
        "note": story.note,
        "chart": _chart(story, runs),
        "largest": _largest(story),
        "changes": [_shown_change(each) for each in story.changes],
    }


def _shown_change(change: Change) -> dict[str, Any]:
    found = change.found or {}
    return {
        **_when(change.run),
        "status": found.get("status", ""),
        "max_error": found.get("max_error"),
        "rms_error": found.get("rms_error"),
        "thumbnail": found.get("thumbnail", ""),
        "runs": change.runs,
    }


def _largest(story: Story) -> float:
    return max((each["max_error"] or 0.0 for each in story.points if each is not None), default=0.0)


def _chart(story: Story, runs: Sequence[Past]) -> list[dict[str, Any]]:
    """Return the marks of a chart: a run from left to right each, its largest error upwards, at the top if unknown."""
    largest = _largest(story)
    step = (_WIDTH - 2 * _MARGIN) / max(len(runs) - 1, 1)
    marks = []
    for number, (run, found) in enumerate(zip(runs, story.points, strict=True)):
        if found is None:
            continue
        error, has_failed = found["max_error"], found["status"] in FAILING
        # A picture without a number that failed is as bad as can be; one that passed is the same.
        height = (1.0 if has_failed else 0.0) if error is None else error / largest if largest else 0.0
        number_words = "" if error is None else f", max {error:.3g}"
        marks.append(
            {
                "x": round(_MARGIN + number * step, 1),
                "y": round(_HEIGHT - _MARGIN - height * (_HEIGHT - 2 * _MARGIN), 1),
                "shown_as": kind_of_status(found["status"]),
                "words": f"{' '.join(_when(run).values())}: {found['status']}{number_words}",
            }
        )
    return marks
