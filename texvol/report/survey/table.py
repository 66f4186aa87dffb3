"""Table of the methods: rows for the page, and a CSV file."""

from __future__ import annotations

import csv
import io
from typing import Any

from texvol.comparison import Difference
from texvol.report.survey.measuring import OWN, MethodMeasurement, Survey
from texvol.report.words import error, max_of, rms_of, seconds

_ORDERS = {
    "before": "Classified at the samples, then interpolated",
    "after": "Interpolated, then classified",
    "projection": "Integral of the value along each ray (X-ray pictures)",
}


def groups(found: Survey) -> list[tuple[str, list[tuple[MethodMeasurement, bool]]]]:
    """Return the headings of the table, and the measurements below each with True for those on the Pareto front.

    On the front, no other method of the group is both faster and nearer to the oracle of the group, by rms error.
    """
    parts = []
    for order, heading in _ORDERS.items():
        rows = [each for each in found.measurements if each.order == order]
        if rows:
            parts.append((heading, [(each, _is_on_front(each, rows)) for each in rows]))
    return parts


def _is_on_front(each: MethodMeasurement, others: list[MethodMeasurement]) -> bool:
    if each.own is None or each.draw_seconds is None:
        return False
    mine = (each.draw_seconds, each.own.rms_error)
    theirs = [(other.draw_seconds, other.own.rms_error) for other in others if other.own and other.draw_seconds]
    return not any(time < mine[0] and size < mine[1] for time, size in theirs)


def cells(each: MethodMeasurement) -> list[str]:
    """Return the numbers of one row as texts, in the order of the page's columns."""
    totals = ["", ""] if each.order == "projection" else [max_of(each.after), rms_of(each.after)]
    return [
        seconds(each.prepare_seconds),
        seconds(each.draw_seconds),
        size_of(each.memory),
        "" if each.bits_per_voxel is None else f"{each.bits_per_voxel:.2g}",
        max_of(each.own),
        rms_of(each.own),
        *totals,
    ]


def size_of(count: int | None) -> str:
    """Bytes in MB (10⁶ bytes), three digits."""
    if count is None:
        return "–"
    return f"{count / 1e6:.3g} MB" if count < 1e9 else f"{count / 1e9:.3g} GB"


def answer(found: Survey) -> str:
    """Return what the table says, in two or three sentences."""
    drawn = [each for each in found.measurements if each.own is not None and each.order != "projection"]
    if not drawn:
        return "No method could draw the scene; the table says why."
    nearest = min(drawn, key=lambda each: each.own.rms_error if each.own else 0.0)
    fastest = min(drawn, key=lambda each: each.draw_seconds or 0.0)
    said = [f"Nearest to the exact integral of its own medium is {nearest.name}: {_of(nearest)}."]
    said.append(f"Fastest is {fastest.name}: {_of(fastest)}.")
    theirs = [each for each in drawn if each.name not in OWN]
    if theirs and fastest.name in OWN:
        other = min(theirs, key=lambda each: each.draw_seconds or 0.0)
        said.append(f"Of the other methods {other.name} is: {_of(other)}.")
    return " ".join(said)


def _of(each: MethodMeasurement) -> str:
    assert each.own is not None
    return f"rms error {error(each.own.rms_error)} in {seconds(each.draw_seconds)}"


def csv_text(found: Survey) -> str:
    """Return a line for each method; unknown numbers are empty. Times in seconds, memory in bytes.

    Errors of projections are fractions of the largest integral.
    """
    text = io.StringIO()
    rows = [_row(each) for each in found.measurements]
    writer = csv.DictWriter(text, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _row(each: MethodMeasurement) -> dict[str, Any]:
    return {
        "method": each.name,
        "source": each.source,
        "order": each.order,
        "sampling_rate": each.sampling_rate,
        "prepare_seconds": each.prepare_seconds,
        "draw_seconds": each.draw_seconds,
        "frames": each.frames,
        "memory_bytes": each.memory,
        "bits_per_voxel": each.bits_per_voxel,
        **_errors("own", each.own),
        **_errors("before", each.before),
        **_errors("after", each.after),
        "skipped": each.skipped,
    }


def _errors(name: str, difference: Difference | None) -> dict[str, float | None]:
    numbers = (None, None) if difference is None else (difference.max_error, difference.rms_error)
    return dict(zip((f"{name}_max_error", f"{name}_rms_error"), numbers, strict=True))
