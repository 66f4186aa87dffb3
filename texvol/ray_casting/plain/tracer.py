"""Trace rays through one volume without light: from cell to cell, pre- and post-classified."""

from __future__ import annotations

from math import inf, isinf, isnan
from typing import NamedTuple

import numpy as np

from texvol.ray_casting.common.bernstein import (
    EPSILON,
    crossing,
    mixed,
    restricted,
    trilinear,
    turning_points,
    value_and_slope,
)
from texvol.ray_casting.common.cells import (
    are_finite,
    color_of_opaque_corners,
    in_cell,
    load_corners,
    point_between,
    range_of,
    value_beside_gaps,
)
from texvol.ray_casting.common.compiling import ZERO, compiled, compiled_and_cached, sources, uncounted, woven_in
from texvol.ray_casting.common.medium import (
    OPAQUE_DEPTH,
    Medium,
    add_opaque,
    add_piece,
    classified,
    medium_of,
    mixed_color,
    points_around,
    segment_of,
)
from texvol.ray_casting.common.rays import Numbers, Rays, Trace, Values, values_of
from texvol.ray_casting.common.references import referenced
from texvol.ray_casting.common.walk import walk_grid
from texvol.scene.scene import CompleteScene


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
    return add_piece((red, green, blue), extinction, False, None, length, depth, light)


@compiled
def cross_postclassified(corners, medium, entry, leave, length, rounding, depth, light):
    """Add a cell whose value is interpolated, then classified; return the optical depth behind it."""
    if not are_finite(corners):
        value = value_beside_gaps(corners, point_between(entry, leave, 0.5), rounding)
        if isnan(value):
            return depth
        if value != 0.0:
            return _add_segment((value, value, value, value), 0.0, 1.0, 0.0, medium, length, depth, light)
    low, high = range_of(corners)
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
    left, right = points_around(points, ZERO, points.size, value, margin)
    part = (0.0, 0.0, 0.0, 0.0)
    if left != right:
        a, b, c, d = restricted(cubic, start, end)
        from_left, width = points[left], points[right] - points[left]
        part = (a - from_left) / width, (b - from_left) / width, (c - from_left) / width, (d - from_left) / width
    if isinf(extinctions[left]) or isinf(extinctions[right]):
        red, green, blue = mixed_color(medium, left, right, min(max(part[0], 0.0), 1.0))
        shown = 0.0 if medium.emissive else 1.0
        return add_opaque((shown * red, shown * green, shown * blue), depth, light)
    extinction = mixed(extinctions[left], extinctions[right], part)
    a, b = medium.colors[left], medium.colors[right]
    color = (mixed(a[0], b[0], part), mixed(a[1], b[1], part), mixed(a[2], b[2], part))
    return add_piece(color, extinction, not medium.glows, None, (end - start) * length, depth, light)


class _Ray(NamedTuple):
    """A ray in index space, the volume it crosses, and scratch memory for one cell."""

    start: Numbers
    step: Numbers
    values: Values
    medium: Medium
    preclassified: bool
    rounding: Numbers
    corners: Numbers  # (8)
    channels: Numbers  # emission and extinction of the corners, (4, 8)
    light: Numbers  # sum of the emission so far, (3)


@woven_in
def _cross(ray, cell, here, there, depth):
    """Add one cell to the light of a ray; return the optical depth behind it, and True if it is opaque."""
    load_corners(ray.values, cell.i, cell.j, cell.k, ray.corners)
    if _may_show(ray.medium, ray.corners):
        entry = in_cell(ray.start, ray.step, here, cell.i, cell.j, cell.k)
        leave = in_cell(ray.start, ray.step, there, cell.i, cell.j, cell.k)
        if ray.preclassified:
            depth = cross_preclassified(
                ray.corners, ray.channels, ray.medium, entry, leave, there - here, ray.rounding, depth, ray.light
            )
        else:
            depth = cross_postclassified(
                ray.corners, ray.medium, entry, leave, there - here, ray.rounding, depth, ray.light
            )
    return depth, not depth < OPAQUE_DEPTH


@woven_in
def _may_show(medium, corners):
    """Return True if the transfer function shows any value between the corners' least and largest."""
    low, high = inf, -inf
    for corner in corners:
        low, high = min(low, corner), max(high, corner)  # NaN is neither
    if low > high:
        return False
    lowest, highest = segment_of(medium.points, low), segment_of(medium.points, high)
    return medium.visible_before[highest + 1] > medium.visible_before[lowest]


def _tracer(sources):
    @compiled_and_cached
    def trace_rays(values, medium, preclassified, starts, steps, ends, rounding, corners, channels, picture):
        """Write light and, in the last channel, optical depth of rays (rows, columns, 3) to `picture`.

        `corners` and `channels` are scratch memory of shapes (8) and (4, 8).
        """
        sources  # noqa: B018 - see compiled_and_cached
        values, medium = referenced(values), referenced(medium)
        volume = uncounted((values, medium, preclassified, rounding, corners, channels))
        starts, steps, ends, picture = uncounted(starts), uncounted(steps), uncounted(ends), uncounted(picture)
        for row in range(picture.shape[0]):
            for column in range(picture.shape[1]):
                light = picture[row, column, :3]
                ray = _Ray(starts[row, column], steps[row, column], *volume, light)
                picture[row, column, 3] = walk_grid(_cross, ray, values.shape, ends[row, column], 0.0)

    return trace_rays


trace_rays = _tracer(sources())


def tracer(scene: CompleteScene, rounding: Numbers) -> Trace:
    """Return the function that traces rays of a scene; `rounding` is that of the rays, see `position_rounding`."""
    medium, values = medium_of(scene.medium), values_of(scene.volume)
    preclassified = scene.classification in ("slab", "extinction")

    def trace(rays: Rays, picture: Numbers) -> None:
        corners, channels = np.empty(8), np.empty((4, 8))
        trace_rays(
            *(values, medium, preclassified, rays.start, rays.step, rays.ends, rounding),
            *(corners, channels, picture),
        )

    return trace
