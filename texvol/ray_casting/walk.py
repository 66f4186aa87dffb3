"""The walk of a ray from cell to cell, in index space: sample (i, j, k) at (i, j, k), s still in world units.

Cell (i, j, k) reaches from sample (i, j, k) to (i+1, j+1, k+1); the cells -1 and n - 1 hold the outer half spacings,
where edge samples are repeated.
"""

from __future__ import annotations

from math import floor, inf

import numpy as np

from texvol.ray_casting.cells import cross_postclassified, cross_preclassified
from texvol.ray_casting.compiling import compiled, compiled_and_kept, sources
from texvol.ray_casting.medium import OPAQUE_DEPTH, segment_of


@compiled
def _trace(values, medium, preclassified, start, step, ends, rounding, corners, channels, light):
    """Optical depth of one ray, `start` + s `step` for s between its `ends`; its emission is added to `light`."""
    here, last = _clipped(start, step, values.shape, ends)
    depth = 0.0
    if not here < last:
        return depth
    i, next_i = _first_cell(start[0], step[0], here)
    j, next_j = _first_cell(start[1], step[1], here)
    k, next_k = _first_cell(start[2], step[2], here)
    while here < last and depth < OPAQUE_DEPTH:
        there = min(next_i, next_j, next_k, last)
        if here < there and _load_corners(values, medium, i, j, k, corners):
            entry, leave = _in_cell(start, step, here, i, j, k), _in_cell(start, step, there, i, j, k)
            length = there - here
            if preclassified:
                depth = cross_preclassified(corners, channels, medium, entry, leave, length, rounding, depth, light)
            else:
                depth = cross_postclassified(corners, medium, entry, leave, length, rounding, depth, light)
        if next_i <= there:
            i, next_i = _next_cell(start[0], step[0], i)
        if next_j <= there:
            j, next_j = _next_cell(start[1], step[1], j)
        if next_k <= there:
            k, next_k = _next_cell(start[2], step[2], k)
        here = max(here, there)
    return depth


@compiled
def _clipped(start, step, shape, ends):
    """Where the ray enters the box (index -1/2 to n - 1/2) and leaves it, between its ends."""
    enter, leave = ends[0], ends[1]
    for axis in range(3):
        low, high = -0.5 - start[axis], shape[2 - axis] - 0.5 - start[axis]
        if step[axis] != 0.0:
            low, high = low / step[axis], high / step[axis]
            enter, leave = max(enter, min(low, high)), min(leave, max(low, high))
        elif low > 0.0 or high < 0.0:
            leave = -inf
    return enter, leave


@compiled
def _first_cell(start, step, s):
    """Along one axis: the cell that holds the ray at s, and where it leaves that."""
    cell = floor(start + s * step)
    return cell, _end_of_cell(start, step, cell)


@compiled
def _next_cell(start, step, cell):
    cell += 1 if step > 0.0 else -1
    return cell, _end_of_cell(start, step, cell)


@compiled
def _end_of_cell(start, step, cell):
    if step == 0.0:
        return inf
    return (cell + (1 if step > 0.0 else 0) - start) / step


@compiled
def _in_cell(start, step, s, i, j, k):
    """Where the ray is at s, as shares of the cell from 0 to 1."""
    return (
        min(max(start[0] + s * step[0] - i, 0.0), 1.0),
        min(max(start[1] + s * step[1] - j, 0.0), 1.0),
        min(max(start[2] + s * step[2] - k, 0.0), 1.0),
    )


@compiled
def _load_corners(values, medium, i, j, k, corners):
    """Whether there may be something to be seen in cell (i, j, k); its samples, edge values repeated, in `corners`."""
    nz, ny, nx = values.shape
    i0, i1 = min(max(i, 0), nx - 1), min(max(i + 1, 0), nx - 1)
    j0, j1 = min(max(j, 0), ny - 1), min(max(j + 1, 0), ny - 1)
    k0, k1 = min(max(k, 0), nz - 1), min(max(k + 1, 0), nz - 1)
    corners[0], corners[1] = values[k0, j0, i0], values[k0, j0, i1]
    corners[2], corners[3] = values[k0, j1, i0], values[k0, j1, i1]
    corners[4], corners[5] = values[k1, j0, i0], values[k1, j0, i1]
    corners[6], corners[7] = values[k1, j1, i0], values[k1, j1, i1]
    low, high = inf, -inf
    for corner in corners:
        low, high = min(low, corner), max(high, corner)  # NaN is neither
    if low > high:
        return False
    lowest, highest = segment_of(medium.points, low), segment_of(medium.points, high)
    return medium.visible_before[highest + 1] > medium.visible_before[lowest]


def _tracer(sources):
    @compiled_and_kept
    def trace_rays(values, medium, preclassified, starts, steps, ends, rounding, picture):
        """Light and, in the last channel, optical depth of rays (rows, columns, 3) in index space, into `picture`."""
        sources  # noqa: B018 - numba keeps one result per set of closed-over values; by itself it watches this file only
        corners, channels = np.empty(8), np.empty((4, 8))
        for row in range(picture.shape[0]):
            for column in range(picture.shape[1]):
                start, step = starts[row, column], steps[row, column]
                light = picture[row, column, :3]
                picture[row, column, 3] = _trace(
                    values, medium, preclassified, start, step, ends[row, column], rounding, corners, channels, light
                )

    return trace_rays


trace_rays = _tracer(sources())
