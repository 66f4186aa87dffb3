"""Marks: covered pixels with coverage and colour, and their compositing with a picture.

With coverage c, the mark's colour m and background b, a premultiplied pixel p of opacity a, which already contains
(1 - a) b of the background, becomes

    over the picture      (1 - c) p + c m            opacity  a + (1 - a) c
    behind the medium     p + (1 - a) c (m - b)      opacity  a
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Numbers = NDArray[np.float64]
Point = tuple[float, float]  # pixels from the upper left corner of the picture to the right and down
Size = tuple[int, int]  # (width, height)
# A pixel projected on a unit vector (a, b) has half the length (a + b) / 2, which is at most √½.
_BEYOND = 0.75
_LEVEL = 1e-12  # pixels: smaller differences of ends count as 0
_LEAST = 1e-6  # least part of a direction, a divisor; the error of the coverage is no larger


class Mark(NamedTuple):
    """Covered pixels, each at most once, with the covered fraction of each."""

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    coverage: Numbers
    color: Numbers  # linear; shape (3,), or (n, 3)


def patch(coverage: Numbers, left: int, top: int, color: ArrayLike, size: Size) -> Mark:
    """Return the mark of an array of coverage with its upper left pixel at (left, top), clipped to the picture."""
    rows, columns = np.nonzero(coverage > 0)
    inside = (rows + top >= 0) & (rows + top < size[1]) & (columns + left >= 0) & (columns + left < size[0])
    rows, columns = rows[inside], columns[inside]
    colors = np.asarray(color, np.float64)
    if colors.ndim > 1:
        colors = colors[rows, columns]
    return Mark(rows + top, columns + left, coverage[rows, columns], colors)


def rectangle(left: float, top: float, right: float, bottom: float, color: ArrayLike, size: Size) -> Mark:
    """Return the mark of an upright rectangle, exact to rounding."""
    columns, rows = (np.arange(max(int(np.floor(low)), 0), min(int(np.ceil(high)), count))
                     for low, high, count in ((left, right, size[0]), (top, bottom, size[1])))  # fmt: skip
    across, down = (np.minimum(positions + 1, high) - np.maximum(positions, low)
                    for positions, low, high in ((columns, left, right), (rows, top, bottom)))  # fmt: skip
    coverage = np.clip(down, 0, 1)[:, np.newaxis] * np.clip(across, 0, 1)
    covered = np.nonzero(coverage > 0)
    return Mark(rows[covered[0]], columns[covered[1]], coverage[covered], np.asarray(color, np.float64))


def line(start: Point, end: Point, width: float, color: ArrayLike, size: Size, opacity: float = 1.0) -> Mark:
    """Return the mark of a straight line of a width in pixels, with square ends at `start` and `end`.

    The coverage of a pixel is the exact area of its part inside the strip. At the ends it is multiplied by the area
    between the ends, which is exact for upright and level lines. A line of length 0 covers nothing.
    """
    kept = within(np.array(start, np.float64), np.array(end, np.float64), width + 2, size)
    length = 0.0 if kept is None else float(np.linalg.norm(kept[1] - kept[0]))
    if kept is None or length < _LEAST:
        return patch(np.zeros((0, 0)), 0, 0, color, size)
    begin, finish = kept
    along = (finish - begin) / length
    major = 0 if abs(along[0]) >= abs(along[1]) else 1
    minor = 1 - major
    low, high = sorted((begin[major], finish[major]))
    reach = width / 2 * abs(along[minor]) + 1
    steps = np.arange(int(np.floor(low - reach)), int(np.ceil(high + reach)) + 1)
    middle = begin[minor] + (steps + 0.5 - begin[major]) * along[minor] / along[major]
    # Half of the strip's section along the minor axis, and half of a pixel's projection on that axis.
    half = int(np.ceil(width / 2 / abs(along[major]) + 0.5 * (1 + abs(along[minor] / along[major])))) + 1
    positions = np.empty((2, steps.size, 2 * half + 1))
    positions[major] = (steps + 0.5)[:, np.newaxis]
    positions[minor] = np.floor(middle)[:, np.newaxis] + np.arange(-half, half + 1) + 0.5
    away = positions - begin[:, np.newaxis, np.newaxis]
    across = away[1] * along[0] - away[0] * along[1]
    onward = away[0] * along[0] + away[1] * along[1]
    coverage = (_beyond(across + width / 2, along[::-1]) - _beyond(across - width / 2, along[::-1])) * (
        _beyond(onward, along) - _beyond(onward - length, along)
    )
    columns, rows = np.floor(positions).astype(np.intp)
    shown = (coverage > 1e-9) & (columns >= 0) & (columns < size[0]) & (rows >= 0) & (rows < size[1])
    return Mark(rows[shown], columns[shown], opacity * coverage[shown], np.asarray(color, np.float64))


def lay_over(pixels: NDArray, mark: Mark) -> None:
    """Composite a mark over the pixels, in place."""
    position = mark.rows, mark.columns
    coverage = mark.coverage[:, np.newaxis]
    pixel = _shown(pixels[position])
    pixels[position] = pixel + coverage * (_opaque(mark) - pixel)


def lay_behind(pixels: NDArray, mark: Mark, background: ArrayLike) -> None:
    """Composite a mark between the medium and the background of the pixels, in place."""
    position = mark.rows, mark.columns
    pixel = _shown(pixels[position])
    let_through = (1 - pixel[:, 3:]) * mark.coverage[:, np.newaxis]
    behind = np.append(_shown(np.asarray(background, np.float64)), 0.0)
    pixels[position] = pixel + let_through * (_opaque(mark) - behind)


def _shown(numbers: NDArray) -> Numbers:
    """Return numbers as an 8-bit file holds them: clipped to [0, 1], NaN as 0."""
    return np.clip(np.nan_to_num(numbers.astype(np.float64)), 0, 1)


def _opaque(mark: Mark) -> Numbers:
    """Return the mark's colour at each of its pixels with opacity 1, shape (n, 4)."""
    return np.column_stack([np.broadcast_to(mark.color, (len(mark.rows), 3)), np.ones(len(mark.rows))])


def _beyond(distance: Numbers, direction: Numbers) -> Numbers:
    """Return the area of a unit pixel beyond an edge, `distance` before its centre along the unit vector `direction`.

    A pixel's projection on the direction is a trapezoid: the convolution of two boxes as wide as the direction's parts.
    """
    a, b = np.maximum(np.abs(direction), _LEAST)
    distance = np.clip(distance, -_BEYOND, _BEYOND)

    def ramp(t: Numbers) -> Numbers:
        return np.maximum(t, 0) ** 2 / 2

    wide, narrow = (a + b) / 2, (a - b) / 2
    area = ramp(distance + wide) - ramp(distance + narrow) - ramp(distance - narrow) + ramp(distance - wide)
    return np.clip(area / (a * b), 0, 1)


def within(start: Numbers, end: Numbers, margin: float, size: Size) -> tuple[Numbers, Numbers] | None:
    """Return the part of a line inside the picture and a margin around it; None if no part is inside."""
    first, last = fractions_inside(start, end, (-margin, -margin, size[0] + margin, size[1] + margin))
    direction = end - start
    return (start + first * direction, start + last * direction) if first < last else None


def fractions_inside(start: Numbers, end: Numbers, rect: tuple[float, float, float, float]) -> tuple[float, float]:
    """Return where a line enters and leaves the rectangle left, top, right, bottom; 1 and 0 if the line misses it."""
    first, last = 0.0, 1.0
    for begin, step, low, high in zip(start.tolist(), (end - start).tolist(), rect[:2], rect[2:], strict=True):
        if abs(step) > _LEVEL:
            one, other = sorted(((low - begin) / step, (high - begin) / step))
            first, last = max(first, one), min(last, other)
        elif not low <= begin <= high:
            return 1.0, 0.0
    return (first, last) if first < last else (1.0, 0.0)
