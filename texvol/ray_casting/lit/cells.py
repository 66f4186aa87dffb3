"""One trilinear cell of a volume with light, pre- and post-classified.

Post-classified, the integrand is smooth between two cuts (`cuts`), and is integrated there by `collocation`.
Pre-classified, the corners are classified and lit, then interpolated, so that emission and extinction are cubics, as
without light; only the depth cue is that of each position, and linear along the ray.
"""

from __future__ import annotations

from math import inf, isinf, isnan, nan, sqrt

import numpy as np

from texvol.ray_casting.common.bernstein import EPSILON, mix, restricted, trilinear
from texvol.ray_casting.common.cells import (
    JUST_INSIDE,
    are_finite,
    color_of_opaque_corners,
    fill,
    load_eight,
    near_and_far,
    point_between,
    range_of,
    value_beside_gaps,
)
from texvol.ray_casting.common.compiling import ZERO, compiled, inlined, woven_in
from texvol.ray_casting.common.lanes import (
    choice,
    greatest,
    greatest_of,
    lane,
    least,
    loaded,
    magnitude,
    root,
    spread,
    store,
)
from texvol.ray_casting.common.medium import OPAQUE_DEPTH, add_opaque, add_piece, cued, segment_of
from texvol.ray_casting.lit.collocation import add_interval, collocate, fields_at, shown
from texvol.ray_casting.lit.cuts import find_cuts, sort_cuts
from texvol.ray_casting.lit.shading import (
    FACING,
    OPAQUE,
    choose,
    cue_at,
    dot,
    facing,
    lit,
    medium_at,
    no_panels,
    opaque_color,
    unit,
)

# Offsets of the corners of a cell along each axis, of which bit 0, 1 and 2 of a corner's number tell.
_OFFSETS = (np.arange(8) >> np.arange(3)[:, np.newaxis] & 1).astype(np.float64)


@inlined
def load_cell(values, gradients, scene, cell, workspace):
    """Write the samples of a cell to `workspace`, edge samples repeated; return True if the cell may show anything."""
    low, high = inf, -inf
    i, j, k = near_and_far(values.shape, cell[0], cell[1], cell[2])
    load_eight(values, i, j, k, workspace.corners)
    for corner in workspace.corners:
        low, high = min(low, corner), max(high, corner)  # NaN is neither
    if not low <= high:
        return False
    medium = scene.medium
    lowest, highest = segment_of(medium.points, low), segment_of(medium.points, high)
    shows = medium.visible_before[highest + 1] > medium.visible_before[lowest]
    if not shows and scene.graded.start.size + scene.contours.shape[0] == 0:
        return False
    steepest = _load_slopes(gradients, scene.gradient_factor, i, j, k, workspace.slopes) if scene.uses_gradient else 0.0
    return shows or _shows_by_gradient(scene, low, high, steepest)


@inlined
def _load_slopes(gradients, factor, i, j, k, slopes):
    """Write the gradients at the corners of a cell to `slopes`; return the largest magnitude."""
    if gradients.single.shape[0] > 0:
        _load_gradients(gradients.single, i, j, k, slopes)
    else:
        _load_gradients(gradients.double, i, j, k, slopes)
    squares = spread(0.0)
    for axis in range(3):
        slope = factor * loaded(slopes[axis])
        slope = choice(magnitude(slope) < inf, slope, 0.0)
        store(slope, slopes[axis])
        squares += slope * slope
    return sqrt(greatest_of(squares))


@woven_in
def _load_gradients(gradients, i, j, k, slopes):
    """Write eight gradients to `slopes`, by their two indices along each axis."""
    for corner in range(8):
        gradient = gradients[k[corner >> 2], j[corner >> 1 & 1], i[corner & 1]]
        slopes[0, corner], slopes[1, corner], slopes[2, corner] = gradient[0], gradient[1], gradient[2]


@woven_in
def sample_of(shape, cell, corner):
    """Return the index (k, j, i) of the sample at a corner of a cell; outside the box, of the nearest edge sample."""
    i = min(max(cell[0] + (corner & 1), 0), shape[2] - 1)
    j = min(max(cell[1] + (corner >> 1 & 1), 0), shape[1] - 1)
    k = min(max(cell[2] + (corner >> 2), 0), shape[0] - 1)
    return k, j, i


@compiled
def _shows_by_gradient(scene, low, high, steepest):
    """Return True if graded media or contours show any value from low to high, for gradients up to `steepest`."""
    graded = scene.graded
    margin = 4 * EPSILON * max(abs(low), abs(high))
    for k in range(graded.start.size):
        first, last = graded.first[k], graded.first[k + 1] - 1
        if (
            high >= graded.values[first] - margin
            and low <= graded.values[last] + margin
            and steepest >= graded.start[k]
        ):
            return True
    for contour in scene.contours:
        away = max(low - contour[0], contour[0] - high)
        if away <= margin or away <= contour[1] * steepest:
            return True
    return False


@inlined
def cross_postclassified(scene, ray, workspace, entry, leave, here, length, rounding, depth, light):
    """Add a cell whose fields are interpolated, then classified and lit; return the optical depth behind it."""
    margin = lay_fields(workspace, entry, leave, rounding)
    if isnan(margin):
        return depth
    start, count = 0.0, find_cuts(scene, ray, workspace, here, length, ZERO)
    sort_cuts(workspace.cuts, count)
    for cut in range(count):
        end = workspace.cuts[cut]
        if start < end and depth < OPAQUE_DEPTH:
            depth = _add_part(scene, ray, workspace, start, end, margin, here, length, depth, light)
            start = end
    return depth


@woven_in
def lay_fields(workspace, entry, leave, rounding):
    """Write value and gradient along a ray, four cubics, to `workspace.field`.

    Return how far two values may be apart that are the same before rounding; NaN if the cell has no value there.
    """
    corners, field = workspace.corners, workspace.field
    beside = 0.0
    if not are_finite(corners):
        beside = value_beside_gaps(corners, point_between(entry, leave, 0.5), rounding)
        if isnan(beside):
            return nan
        if beside != 0.0:
            fill(corners, beside)
    low, high = range_of(corners)
    margin = max(rounding[0], rounding[1], rounding[2]) * (high - low) + 4 * EPSILON * max(abs(low), abs(high))
    field[0, 0], field[0, 1], field[0, 2], field[0, 3] = trilinear(corners, entry, leave)
    for axis in range(3):
        slopes = trilinear(workspace.slopes[axis], entry, leave)
        field[1 + axis, 0], field[1 + axis, 1], field[1 + axis, 2], field[1 + axis, 3] = slopes
    return margin


@inlined
def _add_part(scene, ray, workspace, start, end, margin, here, length, depth, light):
    """Add the part from `start` to `end`, inside one segment of the transfer function; return the depth behind it."""
    if not choose_between(scene, ray, workspace, start, end, margin):
        return depth
    if workspace.chosen[OPAQUE]:
        return add_opaque(opaque_at(scene, ray, workspace, start, end, here, length), depth, light)
    return add_interval(collocate, scene.lights.analytic, scene, ray, workspace, start, end, here, length, depth, light)


@woven_in
def choose_between(scene, ray, workspace, start, end, margin):
    """Return True if a part of a cell shows anything; the segments that hold there go to `workspace.chosen`."""
    value, gradient, m = fields_at(workspace, (start + end) / 2)
    workspace.chosen[FACING] = int(facing(scene.lights, gradient, m, ray.toward_eye))
    return choose(scene, value, m, margin, workspace.chosen)


@compiled
def opaque_at(scene, ray, workspace, start, end, here, length):
    """Return the straight colour, lit and cued, of an opaque part."""
    # Just inside the part: light and eye are on the same side of the surface in all of it, but not at its ends.
    t = spread(mix(start, end, JUST_INSIDE))
    value, gradient, m = fields_at(workspace, t)
    red, green, blue = opaque_color(scene, workspace.chosen, lane(value, 0))
    color, side = (spread(red), spread(green), spread(blue)), float(workspace.chosen[FACING])
    color = shown(scene, ray, color, spread(1.0), gradient, m, side, here + t * length)
    return lane(color[0], 0), lane(color[1], 0), lane(color[2], 0)


@inlined
def cross_preclassified(scene, ray, workspace, cell, entry, leave, here, length, rounding, depth, light):
    """Add a cell whose corners are classified and lit, then interpolated; return the optical depth behind it."""
    channels, opaque, seen = workspace.channels, False, False
    for corner in range(8):
        red, green, blue, extinction = medium_of_corner(scene, workspace, corner)
        channels[0, corner], channels[1, corner], channels[2, corner] = red, green, blue
        channels[3, corner] = extinction
        opaque = opaque or isinf(extinction)
        seen = seen or extinction > 0.0 or max(red, green, blue) > 0.0
    if not seen:
        return depth
    if scene.lit:
        light_corners(scene, workspace, cell)
    if opaque:
        color, weight = color_of_opaque_corners(channels, entry, leave, rounding)
        if weight > 0:
            if scene.cued:
                color = cued(scene.cue, color, 1.0, cue_at(scene.cue, (here - ray.eye) * ray.along))
            return add_opaque(color, depth, light)
    color = (
        trilinear(channels[0], entry, leave),
        trilinear(channels[1], entry, leave),
        trilinear(channels[2], entry, leave),
    )
    extinction = trilinear(channels[3], entry, leave)
    return add_cubics(scene.cued, scene.cue, ray, color, extinction, here, length, depth, light)


@woven_in
def add_cubics(cued, cue, ray, color, extinction, here, length, depth, light):
    """Add a piece of cubic emission and extinction, with or without a depth cue; return the optical depth behind it."""
    if not cued:
        return add_piece(color, extinction, False, None, length, depth, light)
    return _add_cued(cue, ray, color, extinction, here, length, depth, light)


@woven_in
def medium_of_corner(scene, workspace, corner):
    """Return emission (3) and extinction of a corner of a cell, unlit; the straight colour if it is opaque."""
    value = workspace.corners[corner]
    if isnan(value):
        return 0.0, 0.0, 0.0, 0.0
    slopes = workspace.slopes
    gradient = slopes[0, corner], slopes[1, corner], slopes[2, corner]
    m = sqrt(dot(gradient, gradient))
    if not choose(scene, value, m, 0.0, workspace.chosen):
        return 0.0, 0.0, 0.0, 0.0
    if workspace.chosen[OPAQUE]:
        red, green, blue = opaque_color(scene, workspace.chosen, value)
        return red, green, blue, inf
    return medium_at(scene, workspace.chosen, value, m)


@compiled
def light_corners(scene, workspace, cell):
    """Light the emission, or straight colours, of all corners of a cell in `workspace.channels`."""
    channels, slopes = workspace.channels, workspace.slopes
    extinction = loaded(channels[3])
    color = loaded(channels[0]), loaded(channels[1]), loaded(channels[2])
    gradient = loaded(slopes[0]), loaded(slopes[1]), loaded(slopes[2])
    m = root(dot(gradient, gradient))
    x, y, z = _positions_of_samples(scene, cell)
    backward, eye = scene.eye.backward, scene.eye.position
    toward_eye = spread(backward[0]), spread(backward[1]), spread(backward[2])
    if scene.eye.perspective:
        toward_eye = unit((eye[0] - x, eye[1] - y, eye[2] - z))
    side = facing(scene.lights, gradient, m, toward_eye)
    shines = choice(extinction < inf, extinction, 1.0)
    color = lit(scene.lights, color, shines, gradient, m, side, toward_eye, (x, y, z), no_panels())
    store(color[0], channels[0])
    store(color[1], channels[1])
    store(color[2], channels[2])


@woven_in
def _positions_of_samples(scene, cell):
    """Return the positions of the samples at the corners of a cell; outside the box, of the nearest edge samples."""
    middle, axes, centre = scene.middle, scene.world_from_index, scene.centre
    # The last sample of each axis is at twice the middle.
    x = least(greatest(cell[0] + loaded(_OFFSETS[0]), 0.0), 2 * middle[0]) - middle[0]
    y = least(greatest(cell[1] + loaded(_OFFSETS[1]), 0.0), 2 * middle[1]) - middle[1]
    z = least(greatest(cell[2] + loaded(_OFFSETS[2]), 0.0), 2 * middle[2]) - middle[2]
    return (
        axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z + centre[0],
        axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z + centre[1],
        axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z + centre[2],
    )


@compiled
def _add_cued(cue, ray, color, extinction, here, length, depth, light):
    """Add a piece of cubic emission and extinction under a depth cue; return the optical depth behind the piece."""
    cuts = 1.0, 1.0
    if ray.along > 0.0:
        cuts = ((ray.eye + cue.near / ray.along - here) / length, (ray.eye + cue.far / ray.along - here) / length)
    start = 0.0
    for cut in range(3):
        end = min(max(cuts[cut], 0.0), 1.0) if cut < 2 else 1.0
        if start < end:
            part = restricted(extinction, start, end)
            red, green, blue = color
            colors = restricted(red, start, end), restricted(green, start, end), restricted(blue, start, end)
            first = cue_at(cue, (here + start * length - ray.eye) * ray.along)
            last = cue_at(cue, (here + end * length - ray.eye) * ray.along)
            depth = add_piece(colors, part, False, (cue, first, last), (end - start) * length, depth, light)
            start = end
    return depth
