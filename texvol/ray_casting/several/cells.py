"""A piece of a ray through one cell of each of several volumes.

Volumes that are classified before they are interpolated have cubics of emission and extinction, which add up to cubics;
so have labels, which are constant, if the scene has no light. The cuts of all other volumes are sorted together: in the
parts between two cuts the integrand is smooth, and is integrated by `lit.collocation`.
"""

from __future__ import annotations

from math import isinf, isnan

from texvol.ray_casting.common.bernstein import restricted, trilinear, value_at
from texvol.ray_casting.common.cells import color_of_opaque_corners, copy, fill, has_weight, in_cell, point_between
from texvol.ray_casting.common.compiling import ZERO, compiled, woven_in
from texvol.ray_casting.common.lanes import loaded, store
from texvol.ray_casting.common.medium import OPAQUE_DEPTH, add_opaque, cued
from texvol.ray_casting.lit.cells import (
    add_cubics,
    choose_between,
    lay_fields,
    light_corners,
    load_cell,
    medium_of_corner,
    opaque_at,
    sample_of,
)
from texvol.ray_casting.lit.collocation import NODES, add_glows, add_interval, integrate
from texvol.ray_casting.lit.cuts import find_cuts, sort_cuts
from texvol.ray_casting.lit.shading import OPAQUE, cue_at
from texvol.ray_casting.several.arrays import LABELS, PRECLASSIFIED

EXTINCTION = 3  # the channel behind red, green and blue


@compiled
def cross(several, starts, steps, ray, workspace, here, there, depth, light):
    """Add the piece of a ray from `here` to `there` to `light`; return the optical depth behind it."""
    length, common, progress = there - here, several.scenes, workspace.progress
    for channel in range(4):
        fill(workspace.cubics[channel], 0.0)
    fill(workspace.mixed, 0.0)
    posts, anything = ZERO, False
    for v in range(several.kinds.size):
        if not progress.inside[v]:
            continue
        if progress.fresh[v]:
            workspace.samples.visible[v] = _load(several, v, workspace)
            progress.fresh[v] = False
        if not workspace.samples.visible[v]:
            continue
        anything = True
        cell = progress.cells[v]
        entry = in_cell(starts[v], steps[v], here, cell[0], cell[1], cell[2])
        leave = in_cell(starts[v], steps[v], there, cell[0], cell[1], cell[2])
        if _is_classified(several, v):
            _add_samples(several, v, workspace, entry, leave)
        elif _lay_fields(several, v, workspace, entry, leave):
            workspace.posts[posts] = v
            posts += 1
    if not anything:
        return depth
    if common.cued and workspace.mixed[3] > 0.0:
        mixed = workspace.mixed
        fraction = cue_at(common.cue, (here - ray.eye) * ray.along)
        mixed[0], mixed[1], mixed[2] = cued(common.cue, (mixed[0], mixed[1], mixed[2]), mixed[3], fraction)
    if posts > 0:
        return _cross_in_parts(several, ray, workspace, posts, here, length, depth, light)
    if workspace.mixed[3] > 0.0:
        return _add_mixed(workspace, depth, light)
    return _add_cubics(common.cued, common.cue, ray, workspace.cubics, 0.0, 1.0, here, length, depth, light)


@woven_in
def _is_classified(several, v):
    """Return True if samples of volume v are classified before interpolation; lit labels are not."""
    kind = several.kinds[v]
    return kind == PRECLASSIFIED or (kind == LABELS and not several.scenes.lit)


@compiled
def _load(several, v, workspace):
    """Write the samples of the cell of volume v to `workspace`; return True if the cell may show anything."""
    scene, own, samples = several.each[v], several.own[v], workspace.samples
    shape, volume = several.shapes[v], several.volumes[v]
    corners = 1 if several.kinds[v] == LABELS else 8
    ny, nx = shape[1], shape[2]
    cells = workspace.progress.cells
    cell = cells[v, 0], cells[v, 1], cells[v, 2]
    if not load_cell(volume.values, volume.gradients, scene, cell, own):
        return False
    copy(own.corners, samples.values[v])
    weights, colors = volume.weights, volume.colors
    heaviest = 0.0
    for corner in range(corners):
        k, j, i = sample_of(shape, cell, corner)
        samples.weights[v, corner] = weights[(k * ny + j) * nx + i] if scene.masked else 1.0
        heaviest = max(heaviest, samples.weights[v, corner])
    if not _is_classified(several, v):
        return heaviest > 0.0
    seen, samples.opaque[v] = False, False
    for corner in range(corners):
        medium, weight = medium_of_corner(scene, own, corner), samples.weights[v, corner]
        for channel in range(4):
            own.channels[channel, corner] = medium[channel] if weight > 0.0 else 0.0
            seen = seen or own.channels[channel, corner] > 0.0
        samples.opaque[v] = samples.opaque[v] or isinf(own.channels[EXTINCTION, corner])
        if colors.shape[0] > 0:
            k, j, i = sample_of(shape, cell, corner)
            for channel in range(3):
                own.channels[channel, corner] *= colors[(k * ny + j) * nx + i, channel]
    if seen and scene.lit:
        light_corners(scene, own, cell)
    for corner in range(corners):
        if not isinf(own.channels[EXTINCTION, corner]):
            for channel in range(4):
                own.channels[channel, corner] *= samples.weights[v, corner]
    return seen


@compiled
def _add_samples(several, v, workspace, entry, leave):
    """Add the classified samples of volume v to the cubics of a piece; or, if opaque, to the opaque colour."""
    channels, cubics, mixed = workspace.each.channels[v], workspace.cubics, workspace.mixed
    if several.kinds[v] == LABELS:
        weight = 1.0 if workspace.samples.opaque[v] else 0.0
        for channel in range(4):
            if weight == 0.0:
                for k in range(4):
                    cubics[channel, k] += channels[channel, 0]
            else:
                mixed[channel] += weight if channel == EXTINCTION else channels[channel, 0]
        return
    if workspace.samples.opaque[v]:
        for channel in range(4):
            copy(channels[channel], workspace.mended[channel])
        channels = workspace.mended
        color, weight = color_of_opaque_corners(channels, entry, leave, several.rounding[v])
        if weight > 0.0:
            for channel in range(3):
                mixed[channel] += weight * color[channel]
            mixed[3] += weight
            return
    for channel in range(4):
        a, b, c, d = trilinear(channels[channel], entry, leave)
        cubics[channel, 0] += a
        cubics[channel, 1] += b
        cubics[channel, 2] += c
        cubics[channel, 3] += d


@compiled
def _lay_fields(several, v, workspace, entry, leave):
    """Write the fields of volume v, classified after interpolation, to `workspace`; return True if it has values."""
    own, samples = several.own[v], workspace.samples
    if several.kinds[v] == LABELS:
        fill(own.corners, samples.values[v, 0])
        fill(own.field[0], samples.values[v, 0])
        for axis in range(3):
            fill(own.field[1 + axis], own.slopes[axis, 0])
        fill(own.weight, samples.weights[v, 0])
        workspace.margins[v] = 0.0
        return True
    copy(samples.values[v], own.corners)
    rounding = several.rounding[v]
    if several.scenes.masked[v]:
        middle, any_weight = point_between(entry, leave, 0.5), False
        for corner in range(8):
            counts = samples.weights[v, corner] > 0.0 and has_weight(corner, middle, rounding)
            any_weight = any_weight or counts
        if not any_weight:
            return False
        own.weight[0], own.weight[1], own.weight[2], own.weight[3] = trilinear(samples.weights[v], entry, leave)
    workspace.margins[v] = lay_fields(own, entry, leave, rounding)
    return not isnan(workspace.margins[v])


@woven_in
def _cross_in_parts(several, ray, workspace, posts, here, length, depth, light):
    """Add a piece with volumes that are classified after interpolation; return the optical depth behind it."""
    cuts, count = workspace.each.cuts, ZERO
    for k in range(posts):
        v = workspace.posts[k]
        count = find_cuts(several.each[v], ray, several.own[v], here, length, count)
    sort_cuts(cuts, count)
    start = 0.0
    for cut in range(count):
        end = cuts[cut]
        if start < end and depth < OPAQUE_DEPTH:
            depth = _add_part(several, ray, workspace, posts, start, end, here, length, depth, light)
            start = end
    return depth


@compiled
def _add_part(several, ray, workspace, posts, start, end, here, length, depth, light):
    """Add the part from `start` to `end`, inside one segment of each transfer function; return the depth behind it."""
    seen, common = 0, several.scenes
    for k in range(posts):
        v = workspace.posts[k]
        scene, own = several.each[v], several.own[v]
        if not choose_between(scene, ray, own, start, end, workspace.margins[v]):
            continue
        if own.chosen[OPAQUE]:
            color = opaque_at(scene, ray, own, start, end, here, length)
            for channel in range(3):
                workspace.mixed[channel] += color[channel]
            workspace.mixed[3] += 1.0
        else:
            workspace.seen[seen] = v
            seen += 1
    if workspace.mixed[3] > 0.0:
        return _add_mixed(workspace, depth, light)
    if seen == 0:
        return _add_cubics(common.cued, common.cue, ray, workspace.cubics, start, end, here, length, depth, light)
    workspace.counts[0] = seen
    return add_interval(_collocate, False, several, ray, workspace, start, end, here, length, depth, light)


@compiled
def _collocate(several, ray, workspace, start, width, here, length, result):
    """Integrate an interval of all volumes, see `lit.collocation.collocate`."""
    cubics, glows, scene = workspace.cubics, workspace.intervals.glows, several.scenes
    t = start + width * loaded(NODES)
    color = value_at(cubics[0], t), value_at(cubics[1], t), value_at(cubics[2], t)
    extinction = value_at(cubics[3], t)
    if scene.cued:
        color = cued(scene.cue, color, extinction, cue_at(scene.cue, (here + t * length - ray.eye) * ray.along))
    store(color[0], glows[0])
    store(color[1], glows[1])
    store(color[2], glows[2])
    store(extinction, glows[3])
    turn = 0.0
    for k in range(workspace.counts[0]):
        v = workspace.seen[k]
        turn = max(turn, add_glows(several.each[v], ray, several.own[v], start, width, here, length))
    integrate(glows, width * length, result)
    return turn


@compiled
def _add_cubics(cued, cue, ray, cubics, start, end, here, length, depth, light):
    """Add the part from `start` to `end` of a piece that has cubics only; return the optical depth behind it."""
    red, green = _cubic(cubics[0], start, end), _cubic(cubics[1], start, end)
    blue, extinction = _cubic(cubics[2], start, end), _cubic(cubics[3], start, end)
    part, first = (end - start) * length, here + start * length
    return add_cubics(cued, cue, ray, (red, green, blue), extinction, first, part, depth, light)


@woven_in
def _cubic(row, start, end):
    return restricted((row[0], row[1], row[2], row[3]), start, end)


@woven_in
def _add_mixed(workspace, depth, light):
    """Add the mean colour of the opaque volumes at one position; return the infinite optical depth behind it."""
    mixed = workspace.mixed
    return add_opaque((mixed[0] / mixed[3], mixed[1] / mixed[3], mixed[2] / mixed[3]), depth, light)
