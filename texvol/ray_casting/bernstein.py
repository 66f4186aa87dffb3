"""Cubics in Bernstein form: tuples of four coefficients, over a parameter t from 0 to 1.

    p(t) = Σ binomial(3, k) (1-t)^(3-k) t^k p_k

p_0 and p_3 are the values at the ends, and no value lies outside the range of the coefficients. Those that trilinear
filtering makes are averages of samples: where samples are not negative no digit is lost to cancellation.
"""

from __future__ import annotations

from math import nan, sqrt

import numpy as np

from texvol.ray_casting.compiling import compiled

EPSILON = float(np.finfo(np.float64).eps)


@compiled
def mix(a, b, fraction):
    """`a` + `share` (`b` - `a`): exactly `a` where both are the same, so that a flat field stays flat."""
    return a + fraction * (b - a)


@compiled
def linear(a, b, entry, leave):
    """Between the numbers a and b, as the share goes from `entry` to `leave`."""
    return mix(a, b, entry), mix(a, b, leave)


@compiled
def quadratic(a, b, entry, leave):
    """Between the linear a and b, likewise: coefficient k of n is k/n of one and (n - k)/n of another product."""
    return (
        mix(a[0], b[0], entry),
        mix(mix(a[0], b[0], leave), mix(a[1], b[1], entry), 1 / 2),
        mix(a[1], b[1], leave),
    )


@compiled
def cubic(a, b, entry, leave):
    """Between the quadratic a and b, likewise."""
    return (
        mix(a[0], b[0], entry),
        mix(mix(a[0], b[0], leave), mix(a[1], b[1], entry), 2 / 3),
        mix(mix(a[1], b[1], leave), mix(a[2], b[2], entry), 1 / 3),
        mix(a[2], b[2], leave),
    )


@compiled
def trilinear(corners, entry, leave):
    """The cubic that trilinear filtering of eight corners makes of the way from `entry` to `leave` (in the cell)."""
    (x0, y0, z0), (x1, y1, z1) = entry, leave
    near_low = linear(corners[0], corners[1], x0, x1)
    near_high = linear(corners[2], corners[3], x0, x1)
    far_low = linear(corners[4], corners[5], x0, x1)
    far_high = linear(corners[6], corners[7], x0, x1)
    return cubic(quadratic(near_low, near_high, y0, y1), quadratic(far_low, far_high, y0, y1), z0, z1)


@compiled
def mixed(a, b, fraction):
    """`mix` with a cubic share: between the numbers a and b."""
    return mix(a, b, fraction[0]), mix(a, b, fraction[1]), mix(a, b, fraction[2]), mix(a, b, fraction[3])


@compiled
def value_and_slope(cubic, t):
    """Value and derivative at t (de Casteljau)."""
    a, b, c = mix(cubic[0], cubic[1], t), mix(cubic[1], cubic[2], t), mix(cubic[2], cubic[3], t)
    a, b = mix(a, b, t), mix(b, c, t)
    return mix(a, b, t), 3 * (b - a)


@compiled
def value_at(cubic, t):
    """Value at t; quicker, where an ulp does not matter."""
    u = 1 - t
    return u * u * (u * cubic[0] + 3 * t * cubic[1]) + t * t * (3 * u * cubic[2] + t * cubic[3])


@compiled
def quartic_at(d1, d2, d3, d4, t):
    """Value at t of the quartic with coefficients 0, d1 … d4."""
    u = 1 - t
    return t * (4 * u * u * u * d1 + t * (6 * u * u * d2 + t * (4 * u * d3 + t * d4)))


@compiled
def restricted(cubic, start, end):
    """The same cubic over the part of its piece from `start` to `end`."""
    if start == 0.0 and end == 1.0:
        return cubic
    (first, first_slope), (last, last_slope) = value_and_slope(cubic, start), value_and_slope(cubic, end)
    third = (end - start) / 3
    return first, first + third * first_slope, last - third * last_slope, last


@compiled
def turning_points(cubic):
    """Parameters 0 < t < 1 where the cubic turns, ascending; 1 where there is none."""
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
    """Where the cubic, monotone from `start` to `end`, meets a value between those at its ends: Newton in a bracket."""
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
        # A step out of the bracket, or to no other number than its end, is replaced by halving.
        t = step if start < step < end else (start + end) / 2
    return t
