"""The strip of triangles of least area between two closed contours: the shortest path around a graph on a torus.

Fuchs, Kedem and Uselton (1977): node (i, j) is the edge from vertex i of the lower contour to vertex j of the upper; a
step to i + 1 or to j + 1 is a triangle, and costs its area. A strip is a path once around both contours, from (0, s) to
(m, s + n). Shortest paths from different s need not cross each other: the path from s lies between those from s' < s
and s'' > s that are known, which halves the search each time. All paths of one halving are found together.
"""

from __future__ import annotations

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
    first, last = _shortest(*_costs(lower, upper))
    triangles = []
    for i in range(m + 1):
        triangles += [(i % m, m + (j + 1) % n, m + j % n) for j in range(first[i], last[i])]
        if i < m:
            triangles.append((i, (i + 1) % m, m + last[i] % n))
    return np.array(triangles, np.int64)


def area_of(lower: Numbers, upper: Numbers) -> float:
    """Return the area of the strip."""
    corners = np.concatenate([lower, upper])[strip(lower, upper)]
    return float(_areas(*np.moveaxis(corners, 1, 0)).sum())


def _areas(a: Numbers, b: Numbers, c: Numbers) -> Numbers:
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=-1) / 2)


def _costs(lower: Numbers, upper: Numbers) -> tuple[Numbers, Numbers]:
    """Return areas of the steps i → i + 1 at j, shape (m, n); and sums of those j → j + 1 at i, (m + 1, 2 n + 1)."""
    across = _areas(lower[:, np.newaxis], np.roll(lower, -1, axis=0)[:, np.newaxis], upper)
    along = _areas(lower[:, np.newaxis], upper, np.roll(upper, -1, axis=0))
    sums = np.cumsum(np.concatenate([np.zeros((len(lower), 1)), along, along], axis=1), axis=1)
    return across, np.concatenate([sums, sums[:1]])


def _shortest(across: Numbers, sums: Numbers) -> tuple[Integers, Integers]:
    """Return the first and the last j of the shortest path at each i, 0 to m."""
    m, n = across.shape
    first, last = (np.zeros((n + 1, m + 1), np.int64) for _ in range(2))
    costs = np.full(n + 1, np.inf)

    def walk(starts: Integers, least: Integers, most: Integers) -> None:
        # Most bands are narrow, but one goes once around: bands of like width are searched together.
        sizes = np.frexp((most - least).max(axis=1))[1] // 3  # alike within a factor of 8
        for size in np.unique(sizes):
            chosen = sizes == size
            of_size = starts[chosen]
            first[of_size], last[of_size], costs[of_size] = _paths(across, sums, of_size, least[chosen], most[chosen])

    zero = np.zeros((1, m + 1), np.int64)
    walk(np.array([0]), zero, zero + n)
    first[n], last[n] = first[0] + n, last[0] + n  # the same path, once around
    known = np.array([0, n])
    while (gaps := np.diff(known) > 1).any():
        below, beyond = known[:-1][gaps], known[1:][gaps]
        starts = (below + beyond) // 2
        walk(starts, first[below], last[beyond])
        known = np.sort(np.concatenate([known, starts]))
    best = int(np.argmin(costs))
    return first[best], last[best]


def _paths(
    across: Numbers, sums: Numbers, starts: Integers, least: Integers, most: Integers
) -> tuple[Integers, Integers, Numbers]:
    """Return first and last j at each i, and the costs, of the shortest paths from (0, s) to (m, s + n).

    Path number p keeps to least[p, i] ≤ j ≤ most[p, i].
    """
    m, n = across.shape
    paths = np.arange(len(starts))
    offsets = np.arange(int((most - least).max()) + 1)
    entries = np.empty((m + 1, len(starts), len(offsets)), np.int32)
    total = np.where(offsets == (starts - least[:, 0])[:, np.newaxis], 0.0, np.inf)
    for i in range(m + 1):
        columns = least[:, i, np.newaxis] + offsets
        if i:
            shifted = columns - least[:, i - 1, np.newaxis]
            is_there = (shifted >= 0) & (shifted < len(offsets))
            earlier = np.take_along_axis(total, np.clip(shifted, 0, offsets[-1]), axis=1)
            total = np.where(is_there, earlier, np.inf) + across[i - 1, columns % n]
        within = columns <= most[:, i, np.newaxis]
        before = sums[i, np.minimum(columns, 2 * n)]
        # A run from j' to j costs sums[j] - sums[j']: the best j' is where the path enters the row.
        entering = np.where(within, total - before, np.inf)
        best = np.minimum.accumulate(entering, axis=1)
        entries[i] = np.maximum.accumulate(np.where(entering == best, offsets, 0), axis=1)
        total = np.where(within, best + before, np.inf)
    first, last = np.empty_like(least), np.empty_like(least)
    j = starts + n
    costs = total[paths, j - least[:, m]]
    for i in range(m, -1, -1):
        last[:, i] = j
        j = first[:, i] = least[:, i] + entries[i, paths, j - least[:, i]]
    return first, last, costs
