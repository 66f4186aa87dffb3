"""Trace rays through tetrahedra: all segments of a ray, sorted by depth, each with a linear value.

A ray p(s) is inside of a tetrahedron where its four barycentric coordinates, linear in s, are not negative. The value
on that segment is linear in s, so it is handed to `plain` as a cell whose value varies along one axis. Segments of all
tetrahedra are found first and sorted then, so that a ray may leave a grid and enter it again.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.compiling import compiled, compiled_and_cached, sources
from texvol.ray_casting.common.medium import OPAQUE_DEPTH
from texvol.ray_casting.common.rays import Numbers
from texvol.ray_casting.plain.tracer import cross_postclassified

_ENTRY, _LEAVE = (0.0, 0.5, 0.5), (1.0, 0.5, 0.5)  # of a cell that is crossed along its first axis
# Of the change of the value along a segment: rounding of the ends of the segment.
_ROUNDING = (1e-13, 1e-13, 1e-13)


class Cells(NamedTuple):
    """Tetrahedra as arrays; positions are relative to the middle of the grid's box."""

    first: Numbers  # first corners, (m, 3)
    gradients: Numbers  # of the barycentric coordinates, (m, 4, 3)
    values: Numbers  # at the corners, (m, 4)
    pixels: NDArray[np.int64]  # first and last row and column of the picture that each may meet, (m, 4)


@compiled
def _crossed(cells, cell, start, step, nearest):
    """Return the ends of the segment of a ray in a tetrahedron, empty if it misses, and the values there.

    The segment begins at s = `nearest` at the earliest.
    """
    first, gradients, values = cells.first[cell], cells.gradients[cell], cells.values[cell]
    x, y, z = start[0] - first[0], start[1] - first[1], start[2] - first[2]
    enter, leave = nearest, inf
    offset, slope = values[0], 0.0
    for corner in range(4):
        a, b, c = gradients[corner, 0], gradients[corner, 1], gradients[corner, 2]
        weight = a * x + b * y + c * z + (1.0 if corner == 0 else 0.0)
        change = a * step[0] + b * step[1] + c * step[2]
        offset += (values[corner] - values[0]) * weight
        slope += (values[corner] - values[0]) * change
        if change > 0.0:
            enter = max(enter, -weight / change)
        elif change < 0.0:
            leave = min(leave, -weight / change)
        elif weight < 0.0:
            leave = -inf
    return enter, leave, offset + slope * enter, offset + slope * leave


def _tracer(sources):
    @compiled_and_cached
    def trace_tetrahedra(cells, medium, starts, steps, nearest, row, picture):
        """Write light and, in the last channel, optical depth of rays (rows, columns, 3) to `picture`.

        `row` is the first row of these in the whole picture. Returns the longest path of a ray that several tetrahedra
        cover.
        """
        sources  # noqa: B018 - see compiled_and_cached
        rows, columns = picture.shape[:2]
        counts = np.zeros(rows * columns + 1, np.int64)
        kept = np.empty(0, np.int64)
        ends = np.empty((0, 4))
        for filling in range(2):
            for cell in range(len(cells.first)):
                low, high = max(cells.pixels[cell, 0] - row, 0), min(cells.pixels[cell, 1] - row + 1, rows)
                for i in range(low, high):
                    for j in range(cells.pixels[cell, 2], cells.pixels[cell, 3] + 1):
                        enter, leave, front, back = _crossed(cells, cell, starts[i, j], steps[i, j], nearest[i, j])
                        if enter < leave:
                            pixel = i * columns + j
                            if filling == 0:
                                counts[pixel + 1] += 1
                            else:
                                at = kept[pixel]
                                ends[at, 0], ends[at, 1], ends[at, 2], ends[at, 3] = enter, leave, front, back
                                kept[pixel] += 1
            if filling == 0:
                counts = np.cumsum(counts)
                kept, ends = counts[:-1].copy(), np.empty((counts[-1], 4))
        covered = 0.0
        corners = np.empty(8)
        for pixel in range(rows * columns):
            part = ends[counts[pixel] : counts[pixel + 1]]
            light = picture[pixel // columns, pixel % columns]
            covered = max(covered, _integrate(part, medium, corners, light))
        return covered

    return trace_tetrahedra


@compiled
def _integrate(segments, medium, corners, light):
    """Add the segments of a ray to its light; return the length that several of them cover."""
    depth, reached, covered = 0.0, -inf, 0.0
    for number in np.argsort(segments[:, 0]):
        enter, leave, front, back = segments[number]
        covered += max(min(leave, reached) - enter, 0.0)
        reached = max(reached, leave)
        for corner in range(8):
            corners[corner] = back if corner & 1 else front
        if depth < OPAQUE_DEPTH:
            depth = cross_postclassified(corners, medium, _ENTRY, _LEAVE, leave - enter, _ROUNDING, depth, light[:3])
    light[3] = depth
    return covered


trace_tetrahedra = _tracer(sources())
