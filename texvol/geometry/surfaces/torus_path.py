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
    row, column, path = _shortest(*_costs(lower, upper))
    triangles = []
    for i, (first, last) in enumerate(zip(path.first.tolist(), path.last.tolist(), strict=True)):
        p = (row + i) % m
        steps = range(column + first, column + last)
        triangles += [(p, m + (j + 1) % n, m + j % n) for j in steps]
        if i < m:
            triangles.append((p, (p + 1) % m, m + (column + last) % n))
    return np.array(triangles, np.int64)


def area_of(lower: Numbers, upper: Numbers) -> float:
    """Return the area of the strip."""
    corners = np.concatenate([lower, upper])[strip(lower, upper)]
    return float(_areas(*np.moveaxis(corners, 1, 0)).sum())


def _areas(a: Numbers, b: Numbers, c: Numbers) -> Numbers:
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=-1) / 2)


def _costs(lower: Numbers, upper: Numbers) -> tuple[Numbers, Numbers]:
    """Return areas (m, n) of the steps i → i + 1 at j, and of those j → j + 1 at i."""
    across = _areas(lower[:, np.newaxis], np.roll(lower, -1, axis=0)[:, np.newaxis], upper)
    return across, _areas(lower[:, np.newaxis], upper, np.roll(upper, -1, axis=0))


class _Path(NamedTuple):
    """The first and the last j at each i, 0 to m; and the cost."""

    first: Integers
    last: Integers
    cost: float


def _shortest(across: Numbers, along: Numbers) -> tuple[int, int, _Path]:
    """Return a node (i, j) of the shortest path around, and the path from there, as if the node were (0, 0)."""
    m, n = across.shape
    none = np.zeros(m + 1, np.int64)
    sums = _sums(along)
    first = _path(across, sums, 0, none, none + n)
    best = (0, 0, first)
    # The path from n is that from 0, once around.
    gaps = [(0, first, n, _Path(first.first + n, first.last + n, first.cost))]
    while gaps:
        start, low, end, high = gaps.pop()
        if end - start < 2:
            continue
        if (shared := high.first <= low.last).any():
            i = int(np.argmax(shared))
            j = int(high.first[i])
            turned = (np.roll(each, (-i, -j), axis=(0, 1)) for each in (across, along))
            found = i, j, _path(next(turned), _sums(next(turned)), 0, none, none + n)
        else:
            middle = (start + end) // 2
            path = _path(across, sums, middle, low.first, high.last)
            gaps += [(start, low, middle, path), (middle, path, end, high)]
            found = 0, 0, path
        best = min(best, found, key=lambda each: each[2].cost)
    return best


def _sums(along: Numbers) -> Numbers:
    """Return the costs (m + 1, 2 n + 1) from j = 0 to each j, twice around; the last row is the first."""
    sums = np.cumsum(np.concatenate([np.zeros((len(along), 1)), along, along], axis=1), axis=1)
    return np.concatenate([sums, sums[:1]])


def _path(across: Numbers, sums: Numbers, start: int, least: Integers, most: Integers) -> _Path:
    """Return the shortest path from (0, start) to (m, start + n) with least[i] ≤ j ≤ most[i]."""
    m, n = across.shape
    entries = []
    costs = np.array([0.0])
    begin = start  # the j of costs[0]
    for i, (low, high) in enumerate(zip(least.tolist(), most.tolist(), strict=True)):
        entering = np.full(high - low + 1, np.inf)
        j = np.arange(max(low, begin), min(high + 1, begin + len(costs)))
        entering[j - low] = costs[j - begin] + (across[i - 1, j % n] if i else 0.0)
        # A run from j' to j costs sums[j] - sums[j']: the best j' is where the path enters the row.
        before = sums[i, low : high + 1]
        entering -= before
        best = np.minimum.accumulate(entering)
        entries.append(np.maximum.accumulate(np.where(entering == best, np.arange(low, high + 1), low)))
        costs, begin = best + before, low
    first, last = np.empty(m + 1, np.int64), np.empty(m + 1, np.int64)
    j_end = start + n
    cost = float(costs[j_end - begin])
    for i in range(m, -1, -1):
        last[i] = j_end
        j_end = first[i] = entries[i][j_end - least[i]]
    return _Path(first, last, cost)
