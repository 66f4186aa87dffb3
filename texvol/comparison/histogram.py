"""Histogram of the differences of two pictures as SVG; both axes are logarithmic."""

from __future__ import annotations

from dataclasses import dataclass

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
    drawings: list[_Drawing] = []
    if numbers.size:
        low, high = _decades(numbers, limit)
        counts, edges = np.histogram(
            np.clip(np.log10(numbers), low, high), bins=(high - low) * _BINS_PER_DECADE, range=(low, high)
        )
        mark = float(np.log10(limit)) if limit > 0 else -np.inf
        drawings = [_Drawing(kind, width, counts, edges, mark) for kind, width in _WIDTHS.items()]
    return Markup(rendered("histogram.html", drawings=drawings, caption=_caption(largest, numbers.size), limit=limit))


def _caption(largest: NDArray, differing: int) -> str:
    equal, wrong = int((largest == 0).sum()), int((~np.isfinite(largest)).sum())
    parts = [f"{differing:,} of {largest.size:,} pixels differ", f"{equal:,} are equal"]
    if wrong:
        parts.append(f"{wrong:,} hold a NaN or an infinity and are not drawn")
    return "; ".join(parts) + "."


def _decades(numbers: NDArray, limit: float) -> tuple[int, int]:
    """Powers of ten at the ends of the axis of differences; the limit is between them unless it is far off."""
    low, high = int(np.floor(np.log10(numbers.min()))), int(np.floor(np.log10(numbers.max()))) + 1
    if limit > 0:
        high = max(high, int(np.floor(np.log10(limit))) + 1)
        low = min(low, int(np.ceil(np.log10(limit))) - 1)
    return max(low, high - _MOST_DECADES), high


@dataclass(frozen=True)
class _Drawing:
    """Positions in one drawing of the histogram, in units of its view box."""

    kind: str
    width: int
    counts: NDArray
    edges: NDArray  # of the bins, decimal logarithms
    mark: float  # decimal logarithm of the limit
    height = _HEIGHT
    left = _LEFT
    top = _TOP
    bottom = _HEIGHT - _BOTTOM

    @property
    def right(self) -> int:
        return self.width - _RIGHT

    @property
    def has_mark(self) -> bool:
        """True if the limit lies on the axis."""
        return bool(self.edges[0] <= self.mark <= self.edges[-1])

    @property
    def count_decades(self) -> int:
        return max(int(np.ceil(np.log10(self.counts.max()))), 1)

    @property
    def count_ticks(self) -> list[tuple[float, str]]:
        """Position and text of each tick of the axis of counts."""
        return [(self.y(10.0**decade), _power(decade)) for decade in range(self.count_decades + 1)]

    @property
    def difference_ticks(self) -> list[tuple[float, str, str]]:
        """Position, text and anchor of each tick of the axis of differences."""
        low, high = int(self.edges[0]), int(self.edges[-1])
        every = 2 if self.width < 500 and high - low > 5 else 1
        return [
            (self.x(decade), _power(decade), "end" if decade == high else "middle")
            for decade in range(low, high + 1, every)
        ]

    def x(self, decade: float) -> float:
        low, high = self.edges[0], self.edges[-1]
        return float(_LEFT + (self.right - _LEFT) * (decade - low) / (high - low))

    def y(self, count: float) -> float:
        # The axis begins at a half, so that a count of one has a visible height.
        fraction = np.log10(2 * count) / (self.count_decades + np.log10(2)) if count else 0.0
        return float(self.bottom - (self.bottom - _TOP) * fraction)

    def columns(self, over: bool) -> str:
        """SVG path of the columns over the limit, or of the others."""
        is_over = (self.edges[1:] + self.edges[:-1]) / 2 > self.mark
        return "".join(
            f"M{self.x(self.edges[i]) + 0.5:.1f} {self.bottom}V{self.y(self.counts[i]):.1f}"
            f"H{self.x(self.edges[i + 1]) - 0.5:.1f}V{self.bottom}Z"
            for i in np.flatnonzero((is_over == over) & (self.counts > 0))
        )


def _power(decade: int) -> str:
    return {0: "1", 1: "10", 2: "100"}.get(decade, f"1e{decade}")
