"""Interpolation inside one trilinear cell, between the positions where a ray enters and leaves it.

`entry` and `leave` are these positions, as fractions (x, y, z) of the cell from 0 to 1. Corner c of the eight lies on
the far side in x, y, z where bit 0, 1, 2 of c is set.
"""

from __future__ import annotations

from math import copysign, isfinite, isinf

import numpy as np

from texvol.ray_casting.common.bernstein import mix
from texvol.ray_casting.common.compiling import compiled, inlined, woven_in

JUST_INSIDE = 1e-9  # fraction of a piece; stands for the limit from inside where weights vanish on the face itself
LARGEST = float(np.finfo(np.float64).max)


@compiled
def in_cell(start, step, s, i, j, k):
    """Return the position of a ray at s, as fractions of cell (i, j, k) from 0 to 1."""
    return (
        min(max(start[0] + s * step[0] - i, 0.0), 1.0),
        min(max(start[1] + s * step[1] - j, 0.0), 1.0),
        min(max(start[2] + s * step[2] - k, 0.0), 1.0),
    )


@inlined
def load_corners(values, i, j, k, corners):
    """Write the samples of cell (i, j, k) to `corners`; edge samples are repeated beyond the edge."""
    i, j, k = near_and_far(values.shape, i, j, k)
    if values.float32.size > 0:
        load_eight(values.float32, i, j, k, corners)
    elif values.uint8.size > 0:
        load_eight(values.uint8, i, j, k, corners)
    elif values.int16.size > 0:
        load_eight(values.int16, i, j, k, corners)
    elif values.uint16.size > 0:
        load_eight(values.uint16, i, j, k, corners)
    else:
        load_eight(values.float64, i, j, k, corners)


@woven_in
def near_and_far(shape, i, j, k):
    """Return the two indices of the samples of a cell along x, y and z; edge samples are repeated beyond the edge.

    They are unsigned, as numba would count negative ones from the end.
    """
    nz, ny, nx = shape
    return (
        (np.uint64(min(max(i, 0), nx - 1)), np.uint64(min(max(i + 1, 0), nx - 1))),
        (np.uint64(min(max(j, 0), ny - 1)), np.uint64(min(max(j + 1, 0), ny - 1))),
        (np.uint64(min(max(k, 0), nz - 1)), np.uint64(min(max(k + 1, 0), nz - 1))),
    )


@inlined
def load_eight(values, i, j, k, corners):
    """Write eight samples to `corners`, by their two indices along each axis."""
    (i0, i1), (j0, j1), (k0, k1) = i, j, k
    corners[0], corners[1] = values[k0, j0, i0], values[k0, j0, i1]
    corners[2], corners[3] = values[k0, j1, i0], values[k0, j1, i1]
    corners[4], corners[5] = values[k1, j0, i0], values[k1, j0, i1]
    corners[6], corners[7] = values[k1, j1, i0], values[k1, j1, i1]


@compiled
def point_between(entry, leave, t):
    """Return the position at parameter t, which is 0 at `entry` and 1 at `leave`."""
    return mix(entry[0], leave[0], t), mix(entry[1], leave[1], t), mix(entry[2], leave[2], t)


@compiled
def range_of(numbers):
    """Return the lowest and the highest of finite numbers."""
    low = high = numbers[0]
    for number in numbers:
        low, high = min(low, number), max(high, number)
    return low, high


@compiled
def are_finite(numbers):
    """Return False if any number is NaN or infinite."""
    finite = True
    for number in numbers:
        finite = finite and isfinite(number)
    return finite


@compiled
def fill(numbers, number):
    """Set all of an array of one axis to a number."""
    for k in range(numbers.size):
        numbers[k] = number


@compiled
def copy(numbers, others):
    """Write an array of one axis to another."""
    for k in range(numbers.size):
        others[k] = numbers[k]


@compiled
def has_weight(corner, middle, rounding):
    """Return True if a corner has more weight than rounding along a piece of a ray whose middle is `middle`."""
    for axis in range(3):
        fraction = middle[axis] if (corner >> axis) & 1 else 1 - middle[axis]
        if fraction <= rounding[axis]:
            return False
    return True


@compiled
def value_beside_gaps(corners, middle, rounding):
    """Return NaN or ±LARGEST if corners with weight make the value NaN or ±infinity, else 0.

    Corners that are not finite and have no weight are set to 0.
    """
    value = 0.0
    for corner in range(8):
        if not isfinite(corners[corner]):
            if has_weight(corner, middle, rounding):
                value += corners[corner]
            else:
                corners[corner] = 0.0
    return copysign(LARGEST, value) if isinf(value) else value


@compiled
def color_of_opaque_corners(channels, entry, leave, rounding):
    """Return the straight colour of the opaque corners where the ray enters, and their weight.

    A corner of infinite extinction makes its cell opaque wherever it has weight, and hides the other corners' colours.
    If no opaque corner has weight, their `channels` are set to 0.
    """
    middle = point_between(entry, leave, 0.5)
    color, weight = _mean_of_opaque(channels, point_between(entry, leave, JUST_INSIDE), middle, rounding)
    if weight > 0:
        return color, weight
    # On a piece of a few ulps, no number lies just inside.
    color, weight = _mean_of_opaque(channels, middle, middle, rounding)
    if not weight > 0:
        for corner in range(8):
            if isinf(channels[3, corner]):
                for channel in range(4):
                    channels[channel, corner] = 0.0
    return color, weight


@compiled
def _mean_of_opaque(channels, position, middle, rounding):
    """Return the mean colour at `position` of the opaque corners with weight along a piece, and the sum of weights."""
    x, y, z = position
    red, green, blue, total = 0.0, 0.0, 0.0, 0.0
    for corner in range(8):
        if isinf(channels[3, corner]) and has_weight(corner, middle, rounding):
            weight = x if corner & 1 else 1 - x
            weight *= y if corner & 2 else 1 - y
            weight *= z if corner & 4 else 1 - z
            red += weight * channels[0, corner]
            green += weight * channels[1, corner]
            blue += weight * channels[2, corner]
            total += weight
    if total > 0:
        red, green, blue = red / total, green / total, blue / total
    return (red, green, blue), total
