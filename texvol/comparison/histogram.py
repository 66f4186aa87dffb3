"""Histogram of the differences of two pictures as SVG; both axes are logarithmic."""

from __future__ import annotations

from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from texvol.comparison.templates import rendered

_BINS_PER_DECADE = 8
_MOST_DECADES = 9  # float32 holds less than 8 digits; smaller differences are counted in the first bin
_HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 250, 52, 14, 22, 40
_WIDTHS = {"broad": 940, "narrow": 360}  # drawn twice: text that shrinks with the page cannot be read


def histogram(largest: NDArray, limit: float) -> Markup:
    """Inline SVG of a histogram of differences, with the limit marked.

    Parameters
    ----------
    largest : array of shape (height, width)
        Largest difference of each pixel's channels; may be infinite.
    limit : float
        Largest difference that is allowed.
    """
    numbers = largest[np.isfinite(largest) & (largest > 0)]
    broken = int((~np.isfinite(largest)).sum())
    counted = {"total": largest.size, "differing": numbers.size, "equal": int((largest == 0).sum()), "broken": broken}
    drawings = []
    if numbers.size:
        low, high = _decades(numbers, limit)
        counts, edges = np.histogram(
            np.clip(np.log10(numbers), low, high), bins=(high - low) * _BINS_PER_DECADE, range=(low, high)
        )
        mark = float(np.log10(limit)) if limit > 0 else -np.inf
        drawings = [_drawing(kind, counts, edges, mark) for kind in _WIDTHS]
    return Markup(rendered("histogram.html", drawings=drawings, **counted, limit=limit))


def _decades(numbers: NDArray, limit: float) -> tuple[int, int]:
    """Powers of ten at the ends of the axis of differences; the limit is between them unless it is far off."""
    low, high = int(np.floor(np.log10(numbers.min()))), int(np.floor(np.log10(numbers.max()))) + 1
    if limit > 0:
        high = max(high, int(np.floor(np.log10(limit))) + 1)
        low = min(low, int(np.ceil(np.log10(limit))) - 1)
    return max(low, high - _MOST_DECADES), high


def _drawing(kind: str, counts: NDArray, edges: NDArray, mark: float) -> dict[str, Any]:
    """Return positions in one drawing of the histogram, in units of its view box.

    `edges` of the bins and `mark`, the limit, are decimal logarithms.
    """
    width, bottom = _WIDTHS[kind], _HEIGHT - _BOTTOM
    low, high = int(edges[0]), int(edges[-1])
    count_decades = max(int(np.ceil(np.log10(counts.max()))), 1)

    def x(decade: float) -> float:
        return float(_LEFT + (width - _RIGHT - _LEFT) * (decade - low) / (high - low))

    def y(count: float) -> float:
        # The axis begins at a half, so that a count of one has a visible height.
        fraction = np.log10(2 * count) / (count_decades + np.log10(2))
        return float(bottom - (bottom - _TOP) * fraction)

    def columns(chosen: NDArray) -> str:
        return "".join(
            f"M{x(edges[i]) + 0.5:.1f} {bottom}V{y(counts[i]):.1f}H{x(edges[i + 1]) - 0.5:.1f}V{bottom}Z"
            for i in np.flatnonzero(chosen & (counts > 0))
        )

    is_over = (edges[1:] + edges[:-1]) / 2 > mark
    shown_decades = range(low, high + 1, 2 if width < 500 and high - low > 5 else 1)
    return {
        **{"kind": kind, "width": width, "height": _HEIGHT},
        **{"left": _LEFT, "top": _TOP, "right": width - _RIGHT, "bottom": bottom},
        "mark": x(mark) if low <= mark <= high else None,
        "count_ticks": [(y(10.0**decade), _power(decade)) for decade in range(count_decades + 1)],
        "difference_ticks": [(x(each), _power(each), "end" if each == high else "middle") for each in shown_decades],
        **{"columns": columns(~is_over), "columns_over": columns(is_over)},
    }


def _power(decade: int) -> str:
    return {0: "1", 1: "10", 2: "100"}.get(decade, f"1e{decade}")
