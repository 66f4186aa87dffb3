"""One trilinear cell in the projection modes: mean value, highest value, first hit of a surface.

`entry` and `leave` are the positions of the ray's ends in the cell, see `common.cells`; the value between them is a
cubic.
"""

from __future__ import annotations

from math import copysign, inf, isfinite, isnan, nan

import numpy as np

from texvol.ray_casting.common.bernstein import crossing, restricted, trilinear, turning_points, value_and_slope
from texvol.ray_casting.common.cells import point_between, value_beside_gaps
from texvol.ray_casting.common.compiling import compiled

NO_HIT = 2.0  # parameter beyond the end of any cell


@compiled
def gap_value(corners, entry, leave, rounding):
    """Return NaN or ±infinity if corners with weight make the value NaN or ±infinity throughout the cell, else 0.

    Corners that are not finite and have no weight are set to 0.
    """
    if isfinite(corners.sum()):
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
    low, high = corners.min(), corners.max()
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
    low, high = corners.min(), corners.max()
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
