"""The way of a ray through one trilinear cell, as the projection modes see it: mean, highest value, first surface.

`entry` and `leave` are where, as shares (x, y, z) of the cell from 0 to 1; the value between them is a cubic.
"""

from __future__ import annotations

from math import copysign, inf, isfinite, isnan, nan

import numpy as np

from texvol.ray_casting.bernstein import crossing, mix, restricted, trilinear, turning_points, value_and_slope
from texvol.ray_casting.cells import _value_beside_gaps
from texvol.ray_casting.compiling import compiled

NO_HIT = 2.0  # beyond the end of any cell


@compiled
def load_corners(values, sign, i, j, k, corners):
    """The samples of cell (i, j, k) times `sign`, edge values repeated, into `corners` (bits: far in x, y, z)."""
    nz, ny, nx = values.shape
    for corner in range(8):
        x = min(max(i + (corner & 1), 0), nx - 1)
        y = min(max(j + (corner >> 1 & 1), 0), ny - 1)
        z = min(max(k + (corner >> 2), 0), nz - 1)
        corners[corner] = sign * values[z, y, x]


@compiled
def value_beside_gaps(corners, entry, leave, rounding):
    """NaN or ±infinity where corners with weight make the value so throughout the cell, else 0.

    In that case corners that are not finite, and have no weight, are set to 0.
    """
    if isfinite(corners.sum()):
        return 0.0
    middle = mix(entry[0], leave[0], 0.5), mix(entry[1], leave[1], 0.5), mix(entry[2], leave[2], 0.5)
    value = _value_beside_gaps(corners, middle, rounding)
    return copysign(inf, value) if value != 0.0 and not isnan(value) else value


@compiled
def mean_of(corners, beside, entry, leave):
    """Mean of the value along the way: that of its Bernstein coefficients."""
    if beside != 0.0:
        return beside
    a, b, c, d = trilinear(corners, entry, leave)
    return a / 4 + b / 4 + c / 4 + d / 4  # the sum itself may be too large for a number


@compiled
def mean_above(corners, beside, entry, leave, air):
    """Mean along the way of how much the value is above `air`, and of 0 where it is below: cut where it passes that."""
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
    """Integral of max(0, cubic) from `start` to `end`, between which the cubic only rises or only falls."""
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
    """The highest value along the way, or `best` if that is higher."""
    if beside != 0.0:
        return max(best, beside)
    low, high = corners.min(), corners.max()
    if high <= best:
        return best
    cubic = trilinear(corners, entry, leave)
    highest = max(cubic[0], cubic[3])
    for turn in turning_points(cubic):
        highest = max(highest, value_and_slope(cubic, turn)[0])
    return max(best, min(max(highest, low), high))  # rounding may take it an ulp beyond the samples


@compiled
def first_hit(corners, beside, entry, leave, isovalue, side):
    """Where in the cell, 0 to 1, the value first is or passes `isovalue`, or NO_HIT; and on which side it is then.

    `side` is 1 where the value was above before the cell, -1 below, NaN where there was none.
    """
    if isnan(beside):
        return NO_HIT, nan
    low, high = corners.min(), corners.max()
    if beside != 0.0:
        low, high = beside, beside
    if low > isovalue or high < isovalue:
        now = 1.0 if low > isovalue else -1.0
        return (0.0 if side == -now else NO_HIT), now  # a jump to or from infinity passes it on the face
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
