"""The walk of a ray from cell to cell, in index space: sample (i, j, k) at (i, j, k), s still in world units.

Cell (i, j, k) reaches from sample (i, j, k) to (i+1, j+1, k+1); the cells -1 and n - 1 hold the outer half spacings,
where edge samples are repeated. All ray casters share the loop of `walk`: those of one volume through `walk_grid`, that
of several volumes with the faces of all grids.
"""

from __future__ import annotations

from math import floor, inf
from typing import NamedTuple

from texvol.ray_casting.common.compiling import compiled, woven_in


class Cell(NamedTuple):
    """The cell that holds a ray, and the s at which the ray leaves the cell along each axis."""

    i: int
    j: int
    k: int
    leaves_i: float
    leaves_j: float
    leaves_k: float


@woven_in
def walk(next_face, pass_faces, cross, ray, cell, here, last, state):
    """Cross all pieces of a ray between s = `here` and `last`, front to back; return the state behind the last piece.

    Parameters
    ----------
    next_face : function (ray, cell, here, last) -> s of the next face, at most `last`
    pass_faces : function (ray, cell, s) -> cell behind the faces at s
    cross : function (ray, cell, here, there, state) -> state behind a piece, and True if the ray ends there
    """
    ended = False
    while here < last and not ended:
        there = next_face(ray, cell, here, last)
        if here < there:
            state, ended = cross(ray, cell, here, there, state)
        cell = pass_faces(ray, cell, there)
        here = max(here, there)
    return state


@woven_in
def walk_grid(cross, ray, shape, ends, state):
    """Cross all cells of one grid between the ends of a ray, see `walk`; `ray` has the fields `start` and `step`."""
    here, last = clipped(ray.start, ray.step, shape, ends)
    if here < last:
        cell = _cell_at(ray.start, ray.step, here)
        state = walk(_next_face, _pass_faces, cross, ray, cell, here, last, state)
    return state


@woven_in
def _next_face(ray, cell, here, last):
    return min(cell.leaves_i, cell.leaves_j, cell.leaves_k, last)


@woven_in
def _pass_faces(ray, cell, there):
    """Return the cell behind s = `there`; on an edge or a corner of the cell, two or three faces are passed at once."""
    start, step = ray.start, ray.step
    i, leaves_i = cell.i, cell.leaves_i
    j, leaves_j = cell.j, cell.leaves_j
    k, leaves_k = cell.k, cell.leaves_k
    if leaves_i <= there:
        i, leaves_i = next_cell(start[0], step[0], i)
    if leaves_j <= there:
        j, leaves_j = next_cell(start[1], step[1], j)
    if leaves_k <= there:
        k, leaves_k = next_cell(start[2], step[2], k)
    return Cell(i, j, k, leaves_i, leaves_j, leaves_k)


@woven_in
def _cell_at(start, step, s):
    i, leaves_i = first_cell(start[0], step[0], s)
    j, leaves_j = first_cell(start[1], step[1], s)
    k, leaves_k = first_cell(start[2], step[2], s)
    return Cell(i, j, k, leaves_i, leaves_j, leaves_k)


@compiled
def clipped(start, step, shape, ends):
    """Return the s at which a ray enters and leaves the box (index -1/2 to n - 1/2), between its ends."""
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
def first_cell(start, step, s):
    """Return, along one axis, the cell that holds the ray at s and the s at which the ray leaves it."""
    cell = floor(start + s * step)
    return cell, _end_of_cell(start, step, cell)


@compiled
def next_cell(start, step, cell):
    """Return, along one axis, the cell behind a cell and the s at which the ray leaves it."""
    cell += 1 if step > 0.0 else -1
    return cell, _end_of_cell(start, step, cell)


@compiled
def _end_of_cell(start, step, cell):
    if step == 0.0:
        return inf
    return (cell + (1 if step > 0.0 else 0) - start) / step
