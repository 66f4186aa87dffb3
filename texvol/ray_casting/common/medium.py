"""The medium on a ray: the transfer function as arrays, and the integral over a piece in which all is polynomial.

The state of a ray is the light that has been summed so far, and the optical depth in front of the next piece.
"""

from __future__ import annotations

from math import exp, inf, isinf, isnan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.bernstein import mix, quartic_at, value_at
from texvol.ray_casting.common.compiling import compiled, woven_in
from texvol.ray_casting.common.lanes import LANES, loaded, sum_of, transmitted
from texvol.scene.transfer import TransferFunction

OPAQUE_DEPTH = 46.0  # e^-46 = 1e-20: light from behind it changes no float64
# Eight points are exact to degree 15. Over an optical depth of 1, with q of degree 6, the rest is under 1e-10.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(LANES)  # over -1 … 1
GAUSS_POINTS, GAUSS_WEIGHTS = (1 + _POINTS) / 2, _WEIGHTS / 2


class Medium(NamedTuple):
    """A transfer function as arrays; segment k lies between points k - 1 and k, the outermost reach to infinity."""

    points: NDArray[np.float64]
    colors: NDArray[np.float64]
    extinctions: NDArray[np.float64]
    emissive: bool
    glows: bool  # True if `colors` is the emission itself, and not multiplied by the extinction
    visible_before: NDArray[np.int64]  # number of visible segments before segment k


def medium_of(transfer: TransferFunction) -> Medium:
    """Return a transfer function as arrays for compiled code."""
    seen = transfer.extinctions > 0
    if transfer.glows:
        seen = seen | (transfer.colors > 0).any(axis=1)
    of_segments = np.append(seen, seen[-1]) | np.append(seen[0], seen)
    visible_before = np.append(0, np.cumsum(of_segments)).astype(np.int64)
    glow = bool(transfer.emissive), bool(transfer.glows)
    values, colors, extinctions = transfer.values.copy(), transfer.colors.copy(), transfer.extinctions.copy()
    return Medium(values, colors, extinctions, *glow, visible_before)


@compiled
def segment_of(points, value):
    """Return the number of control points at or below the value."""
    low, high = 0, points.size
    while low < high:
        middle = (low + high) // 2
        if points[middle] <= value:
            low = middle + 1
        else:
            high = middle
    return low


@compiled
def points_around(points, first, end, value, margin):
    """Return the points of first … end - 1 left and right of a value; one point twice on a point or beyond the ends."""
    segment = first + segment_of(points[first:end], value)
    left, right = max(segment - 1, first), min(segment, end - 1)
    width = points[right] - points[left]
    # Halfway, a monotone cubic is at least 1/15 of its rise from either end: no whole segment is taken for a point.
    margin = min(margin, width / 32) if width > 0 else margin
    if segment < end and points[right] - value <= margin:
        left = first + segment_of(points[first:end], points[right]) - 1  # at a step, the right one of its two points
        return left, left
    return (left, left) if width == 0 or value - points[left] <= margin else (left, right)


@compiled
def classified(medium, value):
    """Return emission (3) and extinction of a value, as `TransferFunction.classify`; the straight colour if opaque."""
    if isnan(value):
        return 0.0, 0.0, 0.0, 0.0
    segment = segment_of(medium.points, value)
    left, right = max(segment - 1, 0), min(segment, medium.points.size - 1)
    width = medium.points[right] - medium.points[left]
    fraction = (value - medium.points[left]) / width if width > 0 else 0.0
    red, green, blue = mixed_color(medium, left, right, fraction)
    extinction = medium.extinctions[left]
    if fraction > 0:
        extinction = extinction * (1 - fraction) + medium.extinctions[right] * fraction
    factor = 1.0
    if medium.emissive and isinf(extinction):
        factor = 0.0
    elif not medium.glows and not isinf(extinction):
        factor = extinction
    return red * factor, green * factor, blue * factor, extinction


@compiled
def mixed_color(medium, left, right, fraction):
    """Return the mix of the colours of two control points, `fraction` being 0 at `left` and 1 at `right`."""
    a, b = medium.colors[left], medium.colors[right]
    return mix(a[0], b[0], fraction), mix(a[1], b[1], fraction), mix(a[2], b[2], fraction)


@compiled
def add_opaque(color, depth, light):
    """Add the colour of an opaque surface behind `depth` to `light`; return the infinite optical depth behind it."""
    for channel in range(3):
        light[channel] += exp(-depth) * color[channel]
    return inf


@woven_in
def cued(cue, color, extinction, t):
    """Return the emission mixed with the cue's colour by the fraction t; the straight colour if the extinction is 1."""
    shown = t * extinction
    return (
        color[0] * (1 - t) + shown * cue.color[0],
        color[1] * (1 - t) + shown * cue.color[1],
        color[2] * (1 - t) + shown * cue.color[2],
    )


@compiled
def add_piece(color, extinction, straight, cue, length, depth, light):
    """Add the emission of a piece behind `depth` to `light`; return the optical depth behind the piece.

    `color` is three cubics: the emission, or, if `straight`, the straight colour, which times `extinction` is the
    emission. `cue` is None, or a depth cue and the fractions of its colour at both ends, which are linear in between.
    `length` is in world units.
    """
    # The integral of a Bernstein polynomial of degree n has the running sums of its coefficients over n + 1.
    d1 = length / 4 * extinction[0]
    d2 = d1 + length / 4 * extinction[1]
    d3 = d2 + length / 4 * extinction[2]
    d4 = d3 + length / 4 * extinction[3]
    if straight and d4 <= 0.0:
        return depth
    red, green, blue = color
    start, width, reached = 0.0, 1.0, 0.0
    while start < 1.0 and depth + reached < OPAQUE_DEPTH:
        # Halve until an interval is at most 1 deep: e^-x over it is then a polynomial of low degree, to rounding.
        following = quartic_at(d1, d2, d3, d4, start + width)
        while following - reached > 1.0 and start + width / 2 > start:
            width /= 2
            following = quartic_at(d1, d2, d3, d4, start + width)
        t = start + width * loaded(GAUSS_POINTS)
        seen = width * length * loaded(GAUSS_WEIGHTS) * transmitted(depth + quartic_at(d1, d2, d3, d4, t))
        if straight:
            seen *= value_at(extinction, t)
        glow = value_at(red, t), value_at(green, t), value_at(blue, t)
        if cue is not None:
            depth_cue, first, last = cue
            glow = cued(depth_cue, glow, value_at(extinction, t), mix(first, last, t))
        light[0] += sum_of(seen * glow[0])
        light[1] += sum_of(seen * glow[1])
        light[2] += sum_of(seen * glow[2])
        start, reached = start + width, following
        width = min(2 * width, 1 - start)
    return depth + max(d4, 0.0)
