"""One trilinear cell of a volume with light, pre- and post-classified.

Post-classified, the integrand is smooth between two cuts (`cuts`), and is integrated there by `collocation`.
Pre-classified, the corners are classified and lit, then interpolated, so that emission and extinction are cubics, as
without light; only the depth cue is that of each position, and linear along the ray.
"""

from __future__ import annotations

from math import inf, isfinite, isinf, isnan, nan, sqrt

from texvol.ray_casting.common.bernstein import EPSILON, mix, restricted, trilinear
from texvol.ray_casting.common.cells import (
    JUST_INSIDE,
    are_finite,
    color_of_opaque_corners,
    fill,
    point_between,
    range_of,
    value_beside_gaps,
)
from texvol.ray_casting.common.compiling import ZERO, compiled, inlined, woven_in
from texvol.ray_casting.common.medium import OPAQUE_DEPTH, add_opaque, add_piece, cued, segment_of
from texvol.ray_casting.lit.collocation import add_interval, collocate, fields_at, shown
from texvol.ray_casting.lit.cuts import find_cuts, sort_cuts
from texvol.ray_casting.lit.shading import (
    FACING,
    NO_PANEL,
    OPAQUE,
    choose,
    cue_at,
    dot,
    facing,
    lit,
    medium_at,
    opaque_color,
    unit,
)


@inlined
def load_cell(values, gradients, scene, cell, workspace):
    """Write the samples of a cell to `workspace`, edge samples repeated; return True if the cell may show anything."""
    low, high, steepest = inf, -inf, 0.0
    corners, slopes = workspace.corners, workspace.slopes
    uses_gradient, factor = scene.uses_gradient, scene.gradient_factor
    for corner in range(8):
        k, j, i = sample_of(values.shape, cell, corner)
        value = values[k, j, i]
        corners[corner] = value
        low, high = min(low, value), max(high, value)  # NaN is neither
        if uses_gradient:
            square = 0.0
            for axis in range(3):
                slope = factor * _gradient_at(gradients, k, j, i, axis)
                slope = slope if isfinite(slope) else 0.0
                slopes[axis, corner] = slope
                square += slope * slope
            steepest = max(steepest, square)
    return low <= high and _may_show(scene, low, high, sqrt(steepest))


@woven_in
def _gradient_at(gradients, k, j, i, axis):
    """Return a component of the gradient of a sample; one array of `gradients` is empty, see there."""
    if gradients.single.shape[0] > 0:
        return float(gradients.single[k, j, i, axis])
    return gradients.double[k, j, i, axis]


@woven_in
def sample_of(shape, cell, corner):
    """Return the index (k, j, i) of the sample at a corner of a cell; outside the box, of the nearest edge sample."""
    i = min(max(cell[0] + (corner & 1), 0), shape[2] - 1)
    j = min(max(cell[1] + (corner >> 1 & 1), 0), shape[1] - 1)
    k = min(max(cell[2] + (corner >> 2), 0), shape[0] - 1)
    return k, j, i


@compiled
def _may_show(scene, low, high, steepest):
    """Return True if the medium shows any value from low to high, for gradients of magnitude up to `steepest`."""
    medium, graded = scene.medium, scene.graded
    lowest, highest = segment_of(medium.points, low), segment_of(medium.points, high)
    if medium.visible_before[highest + 1] > medium.visible_before[lowest]:
        return True
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
    workspace.chosen[FACING] = facing(scene.lights, gradient, m, ray.toward_eye)
    return choose(scene, value, m, margin, workspace.chosen)


@compiled
def opaque_at(scene, ray, workspace, start, end, here, length):
    """Return the straight colour, lit and cued, of an opaque part."""
    # Just inside the part: light and eye are on the same side of the surface in all of it, but not at its ends.
    t = mix(start, end, JUST_INSIDE)
    value, gradient, m = fields_at(workspace, t)
    color = opaque_color(scene, workspace.chosen, value)
    return shown(scene, ray, color, 1.0, gradient, m, workspace.chosen[FACING], here + t * length)


@inlined
def cross_preclassified(scene, ray, workspace, cell, entry, leave, here, length, rounding, depth, light):
    """Add a cell whose corners are classified and lit, then interpolated; return the optical depth behind it."""
    channels, opaque, seen = workspace.channels, False, False
    for corner in range(8):
        red, green, blue, extinction = medium_of_corner(scene, workspace, cell, corner, (1.0, 1.0, 1.0), 1.0)
        channels[0, corner], channels[1, corner], channels[2, corner] = red, green, blue
        channels[3, corner] = extinction
        opaque = opaque or isinf(extinction)
        seen = seen or extinction > 0.0 or max(red, green, blue) > 0.0
    if not seen:
        return depth
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
def medium_of_corner(scene, workspace, cell, corner, tint, weight):
    """Return lit emission (3) and extinction of a corner of a cell; the straight colour if it is opaque.

    `tint` is the sample's own colour, and `weight` the mask's weight, which does not change an opaque medium.
    """
    value = workspace.corners[corner]
    if isnan(value) or weight == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    gradient = workspace.slopes[0, corner], workspace.slopes[1, corner], workspace.slopes[2, corner]
    m = sqrt(dot(gradient, gradient))
    if not choose(scene, value, m, 0.0, workspace.chosen):
        return 0.0, 0.0, 0.0, 0.0
    if workspace.chosen[OPAQUE]:
        color, extinction, shines, weight = opaque_color(scene, workspace.chosen, value), inf, 1.0, 1.0
    else:
        red, green, blue, extinction = medium_at(scene, workspace.chosen, value, m)
        color, shines = (red, green, blue), extinction
    color = color[0] * tint[0], color[1] * tint[1], color[2] * tint[2]
    if scene.lit:
        position = _position_of_sample(scene, cell, corner)
        toward_eye = scene.eye.backward
        if scene.eye.perspective:
            eye = scene.eye.position
            toward_eye = unit((eye[0] - position[0], eye[1] - position[1], eye[2] - position[2]))
        side = facing(scene.lights, gradient, m, toward_eye)
        color = lit(scene.lights, color, shines, gradient, m, side, toward_eye, position, NO_PANEL)
    return weight * color[0], weight * color[1], weight * color[2], weight * extinction


@woven_in
def _position_of_sample(scene, cell, corner):
    """Return the position of the sample at a corner of a cell; outside the box, of the nearest edge sample."""
    nearest = 2 * scene.middle  # the last sample of each axis
    x = min(max(cell[0] + (corner & 1), 0.0), nearest[0]) - scene.middle[0]
    y = min(max(cell[1] + (corner >> 1 & 1), 0.0), nearest[1]) - scene.middle[1]
    z = min(max(cell[2] + (corner >> 2), 0.0), nearest[2]) - scene.middle[2]
    axes, centre = scene.world_from_index, scene.centre
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
