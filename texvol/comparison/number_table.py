"""Rows of the tables of a comparison's page: measures beside their limits, and the two files."""

from __future__ import annotations

from texvol.comparison.limits import DRIVER_ATTRIBUTE, Limits
from texvol.comparison.measures import Measures
from texvol.comparison.outcome import Outcome
from texvol.comparison.templates import number

DIFFERENCE_ROWS = (
    ("maximum", "max_error"),
    ("rms", "rms_error"),
    ("mean", "mean_error"),
    ("PSNR, dB", "psnr"),
    ("99th percentile", "percentile_99"),
    ("99.9th percentile", "percentile_99_9"),
)


def limit_rows(measures: Measures, limits: Limits) -> tuple[tuple[str, float, float], ...]:
    """Name, measure and limit of each number that has a limit."""
    return (
        (f"pixels off by more than {number(limits.max_abs)}, %", measures.percent_over, limits.fail_percent),
        ("largest difference", measures.beyond_max, limits.hard_max),
        ("farthest outside of its neighbours", measures.outlier, limits.outlier),
        ("rms", measures.beyond_rms, limits.rms),
        ("ꟻLIP, mean", measures.beyond_flip, limits.flip),
    )


def worst_pixel_words(measures: Measures) -> str:
    """Position of the largest difference, and both pixels there."""
    column, row = measures.worst_pixel
    ours, theirs = (", ".join(number(each) for each in values) for values in measures.worst_values)
    return f"column {column}, row {row}: candidate ({ours}), reference ({theirs}) of red, green, blue, opacity"


def file_rows(outcome: Outcome) -> tuple[tuple[str, list[str]], ...]:
    """Name of each property of the files, and its two texts."""
    pair = outcome.candidate, outcome.reference
    sizes = [each.pixels.shape for each in pair]
    return (
        ("file", [each.name for each in pair]),
        ("pixels", [f"{width} × {height}" for height, width, _ in sizes]),
        ("format", [each.words for each in pair]),
        ("driver", [each.attributes.get(DRIVER_ATTRIBUTE, "–") for each in pair]),
        ("software", [each.attributes.get("Software", "–") for each in pair]),
    )
