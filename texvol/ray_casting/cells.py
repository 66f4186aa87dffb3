"""The way of a ray through one trilinear cell, pre- and post-classified.

`entry` and `leave` are where, as shares (x, y, z) of the cell from 0 to 1. Corner c of the eight is the one on the far
side in x, y, z where bit 0, 1, 2 of c is set.
"""

from __future__ import annotations

from math import copysign, isfinite, isinf, isnan

import numpy as np

from texvol.ray_casting.bernstein import (
    EPSILON,
    crossing,
    mix,
    mixed,
    restricted,
    trilinear,
    turning_points,
    value_and_slope,
)
from texvol.ray_casting.compiling import compiled
from texvol.ray_casting.medium import OPAQUE_DEPTH, add_opaque, add_piece, classified, mixed_color, segment_of

JUST_INSIDE = 1e-9  # of a piece; stands for the limit from inside where weights vanish on the face itself
LARGEST = float(np.finfo(np.float64).max)


@compiled
def _has_weight(corner, middle, rounding):
    """Whether a corner (bits: far in x, y, z) counts along a piece through `middle`, beyond rounding."""
    for axis in range(3):
        fraction = middle[axis] if (corner >> axis) & 1 else 1 - middle[axis]
        if fraction <= rounding[axis]:
            return False
    return True


@compiled
def _point_between(entry, leave, t):
    """The point of the cell `t` of the way from `entry` to `leave`."""
    return mix(entry[0], leave[0], t), mix(entry[1], leave[1], t), mix(entry[2], leave[2], t)


@compiled
def cross_preclassified(corners, channels, medium, entry, leave, length, rounding, depth, light):
    """Optical depth behind a cell whose corners are classified, then interpolated. `channels`: scratch (4, 8)."""
    opaque = False
    for corner in range(8):
        red, green, blue, extinction = classified(medium, corners[corner])
        channels[0, corner], channels[1, corner], channels[2, corner] = red, green, blue
        channels[3, corner] = extinction
        opaque = opaque or isinf(extinction)
    if opaque:
        color, weight = _opaque_color(channels, entry, leave, rounding)
        if weight > 0:
            return add_opaque(color, depth, light)
    red, green = trilinear(channels[0], entry, leave), trilinear(channels[1], entry, leave)
    blue, extinction = trilinear(channels[2], entry, leave), trilinear(channels[3], entry, leave)
    return add_piece((red, green, blue), extinction, False, length, depth, light)


@compiled
def _opaque_color(channels, entry, leave, rounding):
    """Colour of the opaque corners where the ray enters, and their weight; those without weight are made empty.

    A corner of infinite extinction makes its cell opaque wherever it has weight, and outshines all others.
    """
    middle = _point_between(entry, leave, 0.5)
    color, weight = _color_of_opaque(channels, _point_between(entry, leave, JUST_INSIDE), middle, rounding)
    if weight > 0:
        return color, weight
    # A way of a few ulps has nothing just inside.
    color, weight = _color_of_opaque(channels, middle, middle, rounding)
    if not weight > 0:
        for corner in range(8):
            if isinf(channels[3, corner]):
                channels[:, corner] = 0.0
    return color, weight


@compiled
def _color_of_opaque(channels, position, middle, rounding):
    """Colour at a place of those opaque corners that count along a piece through `middle`, and their weight there."""
    x, y, z = position
    red, green, blue, total = 0.0, 0.0, 0.0, 0.0
    for corner in range(8):
        if isinf(channels[3, corner]) and _has_weight(corner, middle, rounding):
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


@compiled
def cross_postclassified(corners, medium, entry, leave, length, rounding, depth, light):
    """Optical depth behind a cell whose value is interpolated, then classified."""
    if not isfinite(corners.sum()):
        value = _value_beside_gaps(corners, _point_between(entry, leave, 0.5), rounding)
        if isnan(value):
            return depth
        if value != 0.0:
            return _add_segment((value, value, value, value), 0.0, 1.0, 0.0, medium, length, depth, light)
    low, high = corners.min(), corners.max()
    # Values no farther apart than this could be one value, but for rounding.
    margin = max(rounding[0], rounding[1], rounding[2]) * (high - low) + 4 * EPSILON * max(abs(low), abs(high))
    cubic = trilinear(corners, entry, leave)
    turns = turning_points(cubic)
    start = 0.0
    for span in range(3):
        end = turns[span] if span < 2 else 1.0
        if start < end:
            depth = _cross_monotone(cubic, start, end, margin, medium, length, depth, light)
            start = end
    return depth


@compiled
def _value_beside_gaps(corners, middle, rounding):
    """NaN where a corner with weight makes the value so, ±LARGEST for ±infinity, else 0; corners without weight: 0."""
    value = 0.0
    for corner in range(8):
        if not isfinite(corners[corner]):
            if _has_weight(corner, middle, rounding):
                value += corners[corner]
            else:
                corners[corner] = 0.0
    return copysign(LARGEST, value) if isinf(value) else value


@compiled
def _cross_monotone(cubic, start, end, margin, medium, length, depth, light):
    """Optical depth behind the part of a cell from `start` to `end`, where the value only rises or only falls."""
    first, last = value_and_slope(cubic, start)[0], value_and_slope(cubic, end)[0]
    below, above = segment_of(medium.points, min(first, last)), segment_of(medium.points, max(first, last))
    for crossed in range(above - below + 1):
        cut = end
        if crossed < above - below:
            point = medium.points[below + crossed if first < last else above - 1 - crossed]
            cut = crossing(cubic, point, start, end)
        if start < cut and depth < OPAQUE_DEPTH:
            depth = _add_segment(cubic, start, cut, margin, medium, length, depth, light)
            start = cut
    return depth


@compiled
def _add_segment(cubic, start, end, margin, medium, length, depth, light):
    """Optical depth behind the part from `start` to `end`, where the value stays between two control points."""
    points, extinctions = medium.points, medium.extinctions
    value = value_and_slope(cubic, (start + end) / 2)[0]
    segment = segment_of(points, value)
    left, right = max(segment - 1, 0), min(segment, points.size - 1)
    width = points[right] - points[left]
    # Halfway, a monotone cubic is at least 1/15 of its rise from either end: no whole segment is taken for a point.
    margin = min(margin, width / 32) if width > 0 else margin
    if segment < points.size and points[right] - value <= margin:
        left = segment_of(points, points[right]) - 1  # at a point, its right side holds
        on_point = True
    else:
        on_point = width == 0 or value - points[left] <= margin
    part = (0.0, 0.0, 0.0, 0.0)
    if on_point:
        right = left
    else:
        a, b, c, d = restricted(cubic, start, end)
        from_left = points[left]
        part = (a - from_left) / width, (b - from_left) / width, (c - from_left) / width, (d - from_left) / width
    if isinf(extinctions[left]) or isinf(extinctions[right]):
        red, green, blue = mixed_color(medium, left, right, min(max(part[0], 0.0), 1.0))
        shown = 0.0 if medium.emissive else 1.0
        return add_opaque((shown * red, shown * green, shown * blue), depth, light)
    extinction = mixed(extinctions[left], extinctions[right], part)
    a, b = medium.colors[left], medium.colors[right]
    color = (mixed(a[0], b[0], part), mixed(a[1], b[1], part), mixed(a[2], b[2], part))
    return add_piece(color, extinction, not medium.glows, (end - start) * length, depth, light)
