"""How many pixels differ by how much: counts on a logarithmic scale over differences on a logarithmic scale, as SVG."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_BINS_PER_DECADE = 8
_MOST_DECADES = 9  # float32 holds less than 8 digits; what is smaller is counted in the first bin
_HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 250, 52, 14, 22, 40
_WIDTHS = {"broad": 940, "narrow": 360}  # drawn twice, because letters that shrink with a page can't be read


def histogram(largest: NDArray, limit: float) -> str:
    """Inline SVG of each pixel's largest difference (height, width), which may be infinite, with the limit marked."""
    numbers = largest[np.isfinite(largest) & (largest > 0)]
    words = _words(largest, numbers.size)
    if not numbers.size:
        return f"<p>{words}</p>"
    low, high = _decades(numbers, limit)
    counts, edges = np.histogram(
        np.clip(np.log10(numbers), low, high), bins=(high - low) * _BINS_PER_DECADE, range=(low, high)
    )
    drawings = "".join(_svg(kind, width, counts, edges, limit) for kind, width in _WIDTHS.items())
    return f"<figure>{drawings}<figcaption>{words}</figcaption></figure>"


def _words(largest: NDArray, differing: int) -> str:
    equal, wrong = int((largest == 0).sum()), int((~np.isfinite(largest)).sum())
    parts = [f"{differing:,} of {largest.size:,} pixels differ", f"{equal:,} are equal"]
    if wrong:
        parts.append(f"{wrong:,} hold no number or an infinity, and are not drawn")
    return "; ".join(parts) + "."


def _decades(numbers: NDArray, limit: float) -> tuple[int, int]:
    """Powers of ten that the drawing begins and ends with; the limit is between them if it is not far off."""
    low, high = int(np.floor(np.log10(numbers.min()))), int(np.floor(np.log10(numbers.max()))) + 1
    if limit > 0:
        high = max(high, int(np.floor(np.log10(limit))) + 1)
        low = min(low, int(np.ceil(np.log10(limit))) - 1)
    return max(low, high - _MOST_DECADES), high


@dataclass(frozen=True)
class _Drawing:
    """Where things are in a drawing of `width`, in its own units."""

    width: int
    low: float  # decades of the differences
    high: float
    count_decades: int

    @property
    def right(self) -> int:
        return self.width - _RIGHT

    @property
    def bottom(self) -> int:
        return _HEIGHT - _BOTTOM

    def x(self, decade: float) -> float:
        return float(_LEFT + (self.right - _LEFT) * (decade - self.low) / (self.high - self.low))

    def y(self, count: float) -> float:
        # A single pixel is to be seen too: so the axis begins at a half.
        fraction = np.log10(2 * count) / (self.count_decades + np.log10(2)) if count else 0.0
        return float(self.bottom - (self.bottom - _TOP) * fraction)


def _svg(kind: str, width: int, counts: NDArray, edges: NDArray, limit: float) -> str:
    most = max(int(np.ceil(np.log10(counts.max()))), 1)
    position = _Drawing(width, float(edges[0]), float(edges[-1]), most)
    mark = float(np.log10(limit)) if limit > 0 else -np.inf
    middles = (edges[1:] + edges[:-1]) / 2
    parts = [
        *_axes(position),
        _columns("columns", position, counts, edges, middles <= mark),
        _columns("too-far", position, counts, edges, middles > mark),
        _limit_mark(position, mark, limit) if position.low <= mark <= position.high else "",
    ]
    return (
        f'<svg class="histogram {kind}" viewBox="0 0 {width} {_HEIGHT}" role="img" '
        f'aria-label="Histogram of the differences">{"".join(parts)}</svg>'
    )


def _axes(position: _Drawing) -> Iterator[str]:
    for decade in range(position.count_decades + 1):
        y = position.y(10.0**decade)
        yield f'<line class="grid" x1="{_LEFT}" x2="{position.right}" y1="{y:.1f}" y2="{y:.1f}"/>'
        yield f'<text x="{_LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{_power(decade)}</text>'
    low, high = int(position.low), int(position.high)
    every = 2 if position.width < 500 and high - low > 5 else 1
    for decade in range(low, high + 1, every):
        x, anchor = position.x(decade), "end" if decade == high else "middle"
        yield f'<text x="{x:.1f}" y="{position.bottom + 17}" text-anchor="{anchor}">{_power(decade)}</text>'
    yield f'<text class="name" x="{_LEFT - 6}" y="12" text-anchor="end">pixels</text>'
    yield (
        f'<text class="name" x="{position.right}" y="{_HEIGHT - 5}" text-anchor="end">'
        "difference, the largest of a pixel's channels</text>"
    )


def _columns(kind: str, position: _Drawing, counts: NDArray, edges: NDArray, chosen: NDArray[np.bool_]) -> str:
    path = "".join(
        f"M{position.x(edges[i]) + 0.5:.1f} {position.bottom}V{position.y(counts[i]):.1f}"
        f"H{position.x(edges[i + 1]) - 0.5:.1f}V{position.bottom}Z"
        for i in np.flatnonzero(chosen & (counts > 0))
    )
    return f'<path class="{kind}" d="{path}"/>'


def _limit_mark(position: _Drawing, mark: float, limit: float) -> str:
    x = position.x(mark)
    anchor, shift = ("end", -6) if x > 0.7 * position.width else ("start", 6)
    return (
        f'<line class="limit" x1="{x:.1f}" x2="{x:.1f}" y1="{_TOP - 8}" y2="{position.bottom}"/>'
        f'<text class="name" x="{x + shift:.1f}" y="{_TOP - 8}" text-anchor="{anchor}">limit {limit:.3g}</text>'
    )


def _power(decade: int) -> str:
    return {0: "1", 1: "10", 2: "100"}.get(decade, f"1e{decade}")
