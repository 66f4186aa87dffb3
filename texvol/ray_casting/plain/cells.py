"""One trilinear cell of a volume without light, pre- and post-classified."""

from __future__ import annotations

from math import isfinite, isinf, isnan

from texvol.ray_casting.common.bernstein import (
    EPSILON,
    crossing,
    mixed,
    restricted,
    trilinear,
    turning_points,
    value_and_slope,
)
from texvol.ray_casting.common.cells import color_of_opaque_corners, point_between, value_beside_gaps
from texvol.ray_casting.common.compiling import compiled
from texvol.ray_casting.common.medium import (
    OPAQUE_DEPTH,
    add_opaque,
    add_piece,
    classified,
    mixed_color,
    segment_of,
)


@compiled
def cross_preclassified(corners, channels, medium, entry, leave, length, rounding, depth, light):
    """Add a cell whose corners are classified, then interpolated; return the optical depth behind it.

    `channels` is scratch memory of shape (4, 8) for the emission and extinction of the corners.
    """
    opaque = False
    for corner in range(8):
        red, green, blue, extinction = classified(medium, corners[corner])
        channels[0, corner], channels[1, corner], channels[2, corner] = red, green, blue
        channels[3, corner] = extinction
        opaque = opaque or isinf(extinction)
    if opaque:
        color, weight = color_of_opaque_corners(channels, entry, leave, rounding)
        if weight > 0:
            return add_opaque(color, depth, light)
    red, green = trilinear(channels[0], entry, leave), trilinear(channels[1], entry, leave)
    blue, extinction = trilinear(channels[2], entry, leave), trilinear(channels[3], entry, leave)
    return add_piece((red, green, blue), extinction, False, length, depth, light)


@compiled
def cross_postclassified(corners, medium, entry, leave, length, rounding, depth, light):
    """Add a cell whose value is interpolated, then classified; return the optical depth behind it."""
    if not isfinite(corners.sum()):
        value = value_beside_gaps(corners, point_between(entry, leave, 0.5), rounding)
        if isnan(value):
            return depth
        if value != 0.0:
            return _add_segment((value, value, value, value), 0.0, 1.0, 0.0, medium, length, depth, light)
    low, high = corners.min(), corners.max()
    # Values no farther apart than this may be one value before rounding.
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
def _cross_monotone(cubic, start, end, margin, medium, length, depth, light):
    """Add the part from `start` to `end` of a cell, where the value is monotone; return the optical depth behind it."""
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
    """Add the part from `start` to `end`, where the value lies between two control points; return the depth."""
    points, extinctions = medium.points, medium.extinctions
    value = value_and_slope(cubic, (start + end) / 2)[0]
    segment = segment_of(points, value)
    left, right = max(segment - 1, 0), min(segment, points.size - 1)
    width = points[right] - points[left]
    # Halfway, a monotone cubic is at least 1/15 of its rise from either end: no whole segment is taken for a point.
    margin = min(margin, width / 32) if width > 0 else margin
    if segment < points.size and points[right] - value <= margin:
        left = segment_of(points, points[right]) - 1  # at a step, the right one of its two points
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
