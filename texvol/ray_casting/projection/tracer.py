"""Trace rays through a volume in the projection modes: mean value, highest value, first hit of a surface.

`entry` and `leave` are the positions of the ray's ends in a cell, see `common.cells`; the value between them is a
cubic.
"""

from __future__ import annotations

from math import copysign, inf, isnan, nan
from typing import NamedTuple

import numpy as np

from texvol.ray_casting.common.bernstein import crossing, restricted, trilinear, turning_points, value_and_slope
from texvol.ray_casting.common.cells import (
    are_finite,
    in_cell,
    load_corners,
    point_between,
    range_of,
    value_beside_gaps,
)
from texvol.ray_casting.common.compiling import compiled, compiled_and_cached, sources, uncounted, woven_in
from texvol.ray_casting.common.rays import Numbers, Values
from texvol.ray_casting.common.references import referenced
from texvol.ray_casting.common.walk import walk_grid

NO_HIT = 2.0  # parameter beyond the end of any cell


@compiled
def gap_value(corners, entry, leave, rounding):
    """Return NaN or ±infinity if corners with weight make the value NaN or ±infinity throughout the cell, else 0.

    Corners that are not finite and have no weight are set to 0.
    """
    if are_finite(corners):
        return 0.0
    value = value_beside_gaps(corners, point_between(entry, leave, 0.5), rounding)
    return copysign(inf, value) if value != 0.0 and not isnan(value) else value


@compiled
def mean_of(corners, beside, entry, leave):
    """Return the mean of the value along a ray: the mean of the cubic's coefficients."""
    if beside != 0.0:
        return beside
    a, b, c, d = trilinear(corners, entry, leave)
    return a / 4 + b / 4 + c / 4 + d / 4  # the sum itself may overflow


@compiled
def mean_above(corners, beside, entry, leave, air):
    """Return the mean along a ray of max(0, value - air); the cubic is cut where it meets `air`."""
    if beside != 0.0:
        return max(beside, 0.0)
    a, b, c, d = trilinear(corners, entry, leave)
    above = a - air, b - air, c - air, d - air
    if min(above) >= 0.0:
        return above[0] / 4 + above[1] / 4 + above[2] / 4 + above[3] / 4
    if max(above) <= 0.0:
        return 0.0
    turns = turning_points(above)
    mean, start = 0.0, 0.0
    for span in range(3):
        end = turns[span] if span < 2 else 1.0
        if start < end:
            mean += _positive_part(above, start, end)
            start = end
    return mean


@compiled
def _positive_part(cubic, start, end):
    """Return the integral of max(0, cubic) from `start` to `end`, between which the cubic is monotone."""
    first, last = value_and_slope(cubic, start)[0], value_and_slope(cubic, end)[0]
    if max(first, last) <= 0.0:
        return 0.0
    if min(first, last) < 0.0:
        cut = crossing(cubic, 0.0, start, end)
        start, end = (start, cut) if first > 0.0 else (cut, end)
    a, b, c, d = restricted(cubic, start, end)
    return max((end - start) * (a + b + c + d) / 4, 0.0)


@compiled
def highest_of(corners, beside, entry, leave, best):
    """Return the highest value along a ray, or `best` if that is higher."""
    if beside != 0.0:
        return max(best, beside)
    low, high = range_of(corners)
    if high <= best:
        return best
    cubic = trilinear(corners, entry, leave)
    highest = max(cubic[0], cubic[3])
    for turn in turning_points(cubic):
        highest = max(highest, value_and_slope(cubic, turn)[0])
    return max(best, min(max(highest, low), high))  # rounding may exceed the samples by an ulp


@compiled
def first_hit(corners, beside, entry, leave, isovalue, side):
    """Return the parameter at which the value first meets `isovalue`, or NO_HIT, and the side of the value behind it.

    `side` is 1 if the value in front of the cell is above `isovalue`, -1 if it is below, NaN if there is no value.
    """
    if isnan(beside):
        return NO_HIT, nan
    low, high = range_of(corners)
    if beside != 0.0:
        low, high = beside, beside
    if low > isovalue or high < isovalue:
        now = 1.0 if low > isovalue else -1.0
        return (0.0 if side == -now else NO_HIT), now  # a jump to or from infinity meets the isovalue on the face
    cubic = trilinear(corners, entry, leave)
    turns = turning_points(cubic)
    start = 0.0
    for span in range(3):
        end = turns[span] if span < 2 else 1.0
        if start < end:
            first, last = value_and_slope(cubic, start)[0] - isovalue, value_and_slope(cubic, end)[0] - isovalue
            if first == 0.0 or np.sign(first) == -side:
                return start, side
            side = np.sign(first)
            if last == 0.0:
                return end, side
            if np.sign(last) != side:
                return crossing(cubic, isovalue, start, end), side
            start = end
    return NO_HIT, side


INTEGRAL, HIGHEST, SURFACE, ABOVE = 0, 1, 2, 3


class _Ray(NamedTuple):
    """A ray in index space, the volume it crosses, and scratch memory for one cell."""

    start: Numbers
    step: Numbers
    values: Values
    kind: int
    sign: float
    level: float
    rounding: Numbers
    corners: Numbers  # (8)


@woven_in
def _cross(ray, cell, here, there, state):
    """Return the state (number, length, side) behind a cell, and True if the ray has met a surface there."""
    load_corners(ray.values, cell.i, cell.j, cell.k, ray.corners)
    for corner in range(8):
        ray.corners[corner] *= ray.sign
    entry = in_cell(ray.start, ray.step, here, cell.i, cell.j, cell.k)
    leave = in_cell(ray.start, ray.step, there, cell.i, cell.j, cell.k)
    beside = gap_value(ray.corners, entry, leave, ray.rounding)
    number, length, side = state
    if ray.kind == SURFACE:
        t, side = first_hit(ray.corners, beside, entry, leave, ray.level, side)
        number, length = here + t * (there - here), (0.0 if t < NO_HIT else -1.0)
    elif not isnan(beside):
        number = _add_cell(ray, beside, entry, leave, there - here, number)
        length += there - here
    return (number, length, side), ray.kind == SURFACE and length >= 0.0


@compiled
def _add_cell(ray, beside, entry, leave, length, number):
    """Return the integral, or the highest value, in front of a cell and in it."""
    if ray.kind == INTEGRAL:
        return number + length * mean_of(ray.corners, beside, entry, leave)
    if ray.kind == ABOVE:
        return number + length * mean_above(ray.corners, beside, entry, leave, ray.level)
    return highest_of(ray.corners, beside, entry, leave, number)


def _projector(sources):
    @compiled_and_cached
    def project_rays(values, kind, sign, level, starts, steps, ends, rounding, corners, numbers):
        """Write two numbers of each ray (rows, columns, 3) in index space to `numbers` (rows, columns, 2).

        By `kind`, the first number is the INTEGRAL of the values times `sign`, the HIGHEST of them, or the integral of
        the part ABOVE `level`; the second is the length on which there are values. For SURFACE, the first number is the
        s at which `level` is first met, and the second is negative if it is not met. `corners` is scratch memory of
        shape (8).
        """
        sources  # noqa: B018 - see compiled_and_cached
        values = referenced(values)
        volume = uncounted((values, kind, sign, level, rounding, corners))
        starts, steps, ends, numbers = uncounted(starts), uncounted(steps), uncounted(ends), uncounted(numbers)
        for row in range(numbers.shape[0]):
            for column in range(numbers.shape[1]):
                ray = _Ray(starts[row, column], steps[row, column], *volume)
                state = (-inf if kind == HIGHEST else 0.0), (-1.0 if kind == SURFACE else 0.0), nan
                number, length, _ = walk_grid(_cross, ray, values.shape, ends[row, column], state)
                numbers[row, column, 0], numbers[row, column, 1] = number, length

    return project_rays


project_rays = _projector(sources())
