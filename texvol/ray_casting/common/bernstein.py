"""Cubics in Bernstein form: tuples of four coefficients, over a parameter t from 0 to 1.

    p(t) = Σ binomial(3, k) (1-t)^(3-k) t^k p_k

p_0 and p_3 are the values at the ends, and no value lies outside the range of the coefficients. The coefficients that
trilinear filtering makes are averages of samples: for samples that are not negative, no digit is lost to cancellation.
"""

from __future__ import annotations

from math import nan, sqrt

import numpy as np

from texvol.ray_casting.common.compiling import compiled

EPSILON = float(np.finfo(np.float64).eps)


@compiled
def mix(a, b, fraction):
    """Return a + fraction (b - a): exactly a where a and b are the same, so that a flat field stays flat."""
    return a + fraction * (b - a)


@compiled
def linear(a, b, entry, leave):
    """Return the coefficients of the mix of the numbers a and b, as the fraction goes from `entry` to `leave`."""
    return mix(a, b, entry), mix(a, b, leave)


@compiled
def quadratic(a, b, entry, leave):
    """Return the coefficients of the mix of the linear a and b, as the fraction goes from `entry` to `leave`.

    Coefficient k of n is k/n of one product of coefficients and (n - k)/n of another.
    """
    return (
        mix(a[0], b[0], entry),
        mix(mix(a[0], b[0], leave), mix(a[1], b[1], entry), 1 / 2),
        mix(a[1], b[1], leave),
    )


@compiled
def cubic(a, b, entry, leave):
    """Return the coefficients of the mix of the quadratic a and b, see `quadratic`."""
    return (
        mix(a[0], b[0], entry),
        mix(mix(a[0], b[0], leave), mix(a[1], b[1], entry), 2 / 3),
        mix(mix(a[1], b[1], leave), mix(a[2], b[2], entry), 1 / 3),
        mix(a[2], b[2], leave),
    )


@compiled
def trilinear(corners, entry, leave):
    """Return the cubic of the trilinear field of eight corners on the line from `entry` to `leave` in a cell."""
    (x0, y0, z0), (x1, y1, z1) = entry, leave
    near_low = linear(corners[0], corners[1], x0, x1)
    near_high = linear(corners[2], corners[3], x0, x1)
    far_low = linear(corners[4], corners[5], x0, x1)
    far_high = linear(corners[6], corners[7], x0, x1)
    return cubic(quadratic(near_low, near_high, y0, y1), quadratic(far_low, far_high, y0, y1), z0, z1)


@compiled
def mixed(a, b, fraction):
    """Return the mix of the numbers a and b by a fraction that is itself a cubic."""
    return mix(a, b, fraction[0]), mix(a, b, fraction[1]), mix(a, b, fraction[2]), mix(a, b, fraction[3])


@compiled
def value_and_slope(cubic, t):
    """Return value and derivative at t, by de Casteljau's algorithm."""
    a, b, c = mix(cubic[0], cubic[1], t), mix(cubic[1], cubic[2], t), mix(cubic[2], cubic[3], t)
    a, b = mix(a, b, t), mix(b, c, t)
    return mix(a, b, t), 3 * (b - a)


@compiled
def value_at(cubic, t):
    """Return the value at t; faster than `value_and_slope`, and less exact by an ulp."""
    u = 1 - t
    return u * u * (u * cubic[0] + 3 * t * cubic[1]) + t * t * (3 * u * cubic[2] + t * cubic[3])


@compiled
def quartic_at(d1, d2, d3, d4, t):
    """Return the value at t of the quartic with coefficients 0, d1, d2, d3, d4."""
    u = 1 - t
    return t * (4 * u * u * u * d1 + t * (6 * u * u * d2 + t * (4 * u * d3 + t * d4)))


@compiled
def restricted(cubic, start, end):
    """Return the coefficients of a cubic over the part of its piece from `start` to `end`."""
    if start == 0.0 and end == 1.0:
        return cubic
    (first, first_slope), (last, last_slope) = value_and_slope(cubic, start), value_and_slope(cubic, end)
    third = (end - start) / 3
    return first, first + third * first_slope, last - third * last_slope, last


@compiled
def turning_points(cubic):
    """Return the two parameters 0 < t < 1 where the cubic turns, ascending; 1 in place of a missing one."""
    a, b, c = cubic[1] - cubic[0], cubic[2] - cubic[1], cubic[3] - cubic[2]
    scale = max(abs(a), abs(b), abs(c))
    if scale == 0.0:
        return 1.0, 1.0
    a, b, c = a / scale, b / scale, c / scale
    # A third of the derivative: a (1-t)² + 2 b t (1-t) + c t² = a + 2 (b-a) t + (a-2b+c) t².
    half, square = b - a, a - 2 * b + c
    discriminant = half * half - a * square
    if discriminant <= 0.0:
        return 1.0, 1.0
    root = -half - sqrt(discriminant) if half > 0 else -half + sqrt(discriminant)  # no cancellation
    first = root / square if square != 0.0 else 1.0
    second = a / root if root != 0.0 else 1.0
    first, second = first if 0.0 < first < 1.0 else 1.0, second if 0.0 < second < 1.0 else 1.0
    return min(first, second), max(first, second)


@compiled
def crossing(cubic, value, start, end):
    """Return the t at which a cubic meets a value, by Newton's method in a bracket.

    The cubic is monotone from `start` to `end`, and the value lies between the values at these two.
    """
    rising = value_and_slope(cubic, end)[0] > value_and_slope(cubic, start)[0]
    t = (start + end) / 2
    while start < t < end:
        height, slope = value_and_slope(cubic, t)
        if height == value:
            return t
        if (height < value) == rising:
            start = t
        else:
            end = t
        step = t - (height - value) / slope if slope != 0.0 else nan
        if abs(step - t) <= EPSILON * abs(t):
            return step if start <= step <= end else t
        # A step out of the bracket, or onto its end, is replaced by halving.
        t = step if start < step < end else (start + end) / 2
    return t
