"""The strip of triangles of least area between two closed contours: the shortest path around a graph on a torus.

Fuchs, Kedem and Uselton (1977): node (i, j) is the edge from vertex i of the lower contour to vertex j of the upper; a
step to i + 1 or to j + 1 is a triangle, and costs its area. A strip is a path once around both contours, from (0, s) to
(m, s + n). Shortest paths from different s need not cross each other: the path from s lies between those from s' < s
and s'' > s that are known, which halves the search each time. Where those two share a node, all between them go through
it, and the shortest path through that node ends the search there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Numbers = NDArray[np.float64]


def strip(lower: Numbers, upper: Numbers) -> Integers:
    """Return the triangles (m + n, 3) between contours (m, 3) and (n, 3); vertices of the upper count from m.

    Both contours go the same way around. Triangles go along the lower one, and against the upper one.
    """
    m, n = len(lower), len(upper)
    if m > n:  # rows are a loop, columns are not
        turned = strip(upper, lower)[:, ::-1]
        return np.where(turned < n, turned + m, turned - n)
    path = _shortest(*_costs(lower, upper))
    triangles = []
    for i, (first, last) in enumerate(zip(path.first.tolist(), path.last.tolist(), strict=True)):
        p = (path.row + i) % m
        triangles += [(p, m + (j + 1) % n, m + j % n) for j in range(first, last)]
        if i < m:
            triangles.append((p, (p + 1) % m, m + last % n))
    return np.array(triangles, np.int64)


def area_of(lower: Numbers, upper: Numbers) -> float:
    """Return the area of the strip."""
    corners = np.concatenate([lower, upper])[strip(lower, upper)]
    return float(_areas(*np.moveaxis(corners, 1, 0)).sum())


def _areas(a: Numbers, b: Numbers, c: Numbers) -> Numbers:
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=-1) / 2)


def _costs(lower: Numbers, upper: Numbers) -> tuple[Numbers, Numbers]:
    """Return areas (m, n) of the steps i → i + 1 at j; and sums (m, 2 n + 1) of those from 0 to j, twice around."""
    across = _areas(lower[:, np.newaxis], np.roll(lower, -1, axis=0)[:, np.newaxis], upper)
    along = _areas(lower[:, np.newaxis], upper, np.roll(upper, -1, axis=0))
    return across, np.cumsum(np.concatenate([np.zeros((len(lower), 1)), along, along], axis=1), axis=1)


class _Path(NamedTuple):
    """A path once around: the first and the last j at each i, m + 1 of them from `row` on; and the cost."""

    first: Integers
    last: Integers
    cost: float
    row: int = 0


def _shortest(across: Numbers, sums: Numbers) -> _Path:
    m, n = across.shape
    none = np.zeros(m + 1, np.int64)
    best = first = _path(across, sums, (0, 0), none, none + n)
    # The path from n is that from 0, once around.
    gaps = [(0, first, n, _Path(first.first + n, first.last + n, first.cost))]
    while gaps:
        start, low, end, high = gaps.pop()
        if end - start < 2:
            continue
        if (shared := high.first <= low.last).any():
            i = int(np.argmax(shared))
            found = _through(across, sums, (i, int(high.first[i])), low, high)
        else:
            middle = (start + end) // 2
            found = _path(across, sums, (0, middle), low.first, high.last)
            gaps += [(start, low, middle, found), (middle, found, end, high)]
        best = min(best, found, key=lambda path: path.cost)
    return best


def _through(across: Numbers, sums: Numbers, node: tuple[int, int], low: _Path, high: _Path) -> _Path:
    """Return the shortest path through a node, of those between two paths from row 0."""
    m, n = across.shape
    row, column = node
    once = column // n * n  # columns are known up to 2 n
    least = np.concatenate([low.first[row:], low.first[1 : row + 1] + n]) - once
    most = np.concatenate([high.last[row:m], high.last[: row + 1] + n]) - once
    column -= once
    return _path(across, sums, (row, column), least.clip(column), most.clip(None, column + n))


def _path(across: Numbers, sums: Numbers, node: tuple[int, int], least: Integers, most: Integers) -> _Path:
    """Return the shortest path from a node (i, j) to (i + m, j + n), least ≤ j ≤ most in each of its rows."""
    m, n = across.shape
    row, start = node
    entries = []
    costs = np.array([0.0])
    begin = start  # the j of costs[0]
    for i, (low, high) in enumerate(zip(least.tolist(), most.tolist(), strict=True)):
        entering = np.full(high - low + 1, np.inf)
        j = np.arange(max(low, begin), min(high + 1, begin + len(costs)))
        entering[j - low] = costs[j - begin] + (across[(row + i - 1) % m, j % n] if i else 0.0)
        # A run from j' to j costs sums[j] - sums[j']: the best j' is where the path enters the row.
        before = sums[(row + i) % m, low : high + 1]
        entering -= before
        best = np.minimum.accumulate(entering)
        entries.append(np.maximum.accumulate(np.where(entering == best, np.arange(low, high + 1), low)))
        costs, begin = best + before, low
    first, last = np.empty(m + 1, np.int64), np.empty(m + 1, np.int64)
    end = start + n
    cost = float(costs[end - begin])
    for i in range(m, -1, -1):
        last[i] = end
        end = first[i] = entries[i][end - least[i]]
    return _Path(first, last, cost, row)
