"""The walk of a ray from cell to cell for the projection modes; `walk` is that for light."""

from __future__ import annotations

from math import inf, isnan, nan

import numpy as np

from texvol.ray_casting.compiling import compiled, compiled_and_kept, sources
from texvol.ray_casting.projection_cells import (
    NO_HIT,
    first_hit,
    highest_of,
    load_corners,
    mean_above,
    mean_of,
    value_beside_gaps,
)
from texvol.ray_casting.walk import _clipped, _first_cell, _in_cell, _next_cell

INTEGRAL, HIGHEST, SURFACE, ABOVE = 0, 1, 2, 3


@compiled
def _cross(kind, level, corners, beside, entry, leave, length, number, direction, side):
    """(number, way, side) behind a cell, see `project_rays`; `way` is less than 0 before a surface is found."""
    if kind == SURFACE:
        fraction, side = first_hit(corners, beside, entry, leave, level, side)
        return fraction * length, (0.0 if fraction < NO_HIT else -1.0), side
    if isnan(beside):
        return number, direction, side
    if kind == INTEGRAL:
        number += length * mean_of(corners, beside, entry, leave)
    elif kind == ABOVE:
        number += length * mean_above(corners, beside, entry, leave, level)
    else:
        number = highest_of(corners, beside, entry, leave, number)
    return number, direction + length, side


@compiled
def _walk(values, kind, sign, level, start, step, ends, rounding, corners):
    """The two numbers of one ray, `start` + s `step` for s between its ends, see `project_rays`."""
    here, last = _clipped(start, step, values.shape, ends)
    number, direction, side = (-inf if kind == HIGHEST else 0.0), (-1.0 if kind == SURFACE else 0.0), nan
    if not here < last:
        return number, direction
    i, next_i = _first_cell(start[0], step[0], here)
    j, next_j = _first_cell(start[1], step[1], here)
    k, next_k = _first_cell(start[2], step[2], here)
    while here < last:
        there = min(next_i, next_j, next_k, last)
        if here < there:
            load_corners(values, sign, i, j, k, corners)
            entry, leave = _in_cell(start, step, here, i, j, k), _in_cell(start, step, there, i, j, k)
            beside = value_beside_gaps(corners, entry, leave, rounding)
            number, direction, side = _cross(
                kind, level, corners, beside, entry, leave, there - here, number, direction, side
            )
            if kind == SURFACE and direction >= 0.0:
                return here + number, direction
        if next_i <= there:
            i, next_i = _next_cell(start[0], step[0], i)
        if next_j <= there:
            j, next_j = _next_cell(start[1], step[1], j)
        if next_k <= there:
            k, next_k = _next_cell(start[2], step[2], k)
        here = max(here, there)
    return number, direction


def _projector(sources):
    @compiled_and_kept
    def project_rays(values, kind, sign, level, starts, steps, ends, rounding, numbers):
        """Two numbers for each of rays (rows, columns, 3) in index space, into `numbers` (rows, columns, 2).

        Of the values times `sign`, and with the length of the way where there are any: the INTEGRAL, or the HIGHEST
        one; or, ABOVE, the integral of how much they are above `level`. SURFACE: the s where `level` is first met, and
        a number less than 0 where it is not.
        """
        sources  # noqa: B018 - numba keeps one result per set of closed-over values; by itself it watches this file only
        corners = np.empty(8)
        for row in range(numbers.shape[0]):
            for column in range(numbers.shape[1]):
                number, direction = _walk(
                    values,
                    kind,
                    sign,
                    level,
                    starts[row, column],
                    steps[row, column],
                    ends[row, column],
                    rounding,
                    corners,
                )
                numbers[row, column, 0], numbers[row, column, 1] = number, direction

    return project_rays


project_rays = _projector(sources())
