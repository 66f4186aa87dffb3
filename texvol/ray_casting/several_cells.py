"""The way of a ray through the cells of several volumes at once: the twin of `lit_cells` for what adds up.

A *piece* of a ray lies in one cell of each volume that it is in. There, volumes that are classified before they are
interpolated have cubics, which add up to cubics; so have labels, which are constant, unless light falls on them. The
cuts of all others are sorted together: in the parts between them everything is smooth, and is integrated by
`collocation`.
"""

from __future__ import annotations

from math import isinf, isnan

from texvol.ray_casting.bernstein import restricted, trilinear, value_at
from texvol.ray_casting.cells import _has_weight, _opaque_color, _point_between
from texvol.ray_casting.collocation import NODES, add_glows, add_interval, integrate
from texvol.ray_casting.compiling import compiled, inlined, woven_in
from texvol.ray_casting.lit_cells import (
    add_cubics,
    choose_between,
    lay_fields,
    load_cell,
    medium_of_corner,
    opaque_at,
    sample_of,
)
from texvol.ray_casting.lit_cuts import find_cuts, sort_cuts
from texvol.ray_casting.lit_ray import NODE_COUNT
from texvol.ray_casting.medium import OPAQUE_DEPTH, add_opaque
from texvol.ray_casting.several_bench import bench_of
from texvol.ray_casting.several_scene import (
    COLORS,
    GRADIENTS,
    LABELS,
    PRECLASSIFIED,
    VALUES,
    WEIGHTS,
    part_of,
    scene_of,
)
from texvol.ray_casting.shading import OPAQUE, cue_at, cued
from texvol.ray_casting.walk import _in_cell

EXTINCTION = 3  # the channel behind red, green and blue


@woven_in
def cross(several, starts, steps, ray, bench, here, there, depth, light):
    """Optical depth behind a piece of a ray, from `here` to `there`; its emission is added to `light`."""
    length, common = there - here, several.common
    bench.cubics[:] = 0.0
    bench.mixed[:] = 0.0
    posts, anything = 0, False
    for v in range(several.kinds.size):
        if not bench.inside[v]:
            continue
        if bench.fresh[v]:
            bench.visible[v] = _load(several, v, bench)
            bench.fresh[v] = False
        if not bench.visible[v]:
            continue
        anything = True
        cell = bench.cells[v]
        entry = _in_cell(starts[v], steps[v], here, cell[0], cell[1], cell[2])
        leave = _in_cell(starts[v], steps[v], there, cell[0], cell[1], cell[2])
        if _is_classified(several, v):
            _add_samples(several, v, bench, entry, leave)
        elif _lay_fields(several, v, bench, entry, leave):
            bench.posts[posts] = v
            posts += 1
    if not anything:
        return depth
    if common.cued and bench.mixed[3] > 0.0:
        _cue_mixed(common.cue, ray, bench, here)
    if posts > 0:
        return _cross_in_parts(several, ray, bench, posts, here, length, depth, light)
    if bench.mixed[3] > 0.0:
        return _add_mixed(bench, depth, light)
    return _add_cubics(common.cued, common.cue, ray, bench.cubics, 0.0, 1.0, here, length, depth, light)


@woven_in
def _is_classified(several, v):
    """Whether all of a cell of volume v is known at its samples: light falls on labels place by place."""
    kind = several.kinds[v]
    return kind == PRECLASSIFIED or (kind == LABELS and not several.common.lit)


@woven_in
def _load(several, v, bench):
    """Whether there may be something to be seen in the cell of volume v; what there is at its corners in `bench`."""
    scene, room = scene_of(several, v), bench_of(bench, v, 0)
    shape = several.shapes[v]
    corners = 1 if several.kinds[v] == LABELS else 8
    nz, ny, nx = shape[0], shape[1], shape[2]
    cell = bench.cells[v, 0], bench.cells[v, 1], bench.cells[v, 2]
    values = part_of(several, VALUES, v, several.values).reshape((nz, ny, nx))
    slopes = part_of(several, GRADIENTS, v, several.gradients)
    planes = nz if slopes.shape[0] > 0 else 0
    if not load_cell(values, slopes.reshape((planes, ny, nx, 3)), scene, cell, room):
        return False
    bench.values[v, :] = room.corners
    weights, colors = part_of(several, WEIGHTS, v, several.weights), part_of(several, COLORS, v, several.colors)
    heaviest = 0.0
    for corner in range(corners):
        k, j, i = sample_of(shape, cell, corner)
        bench.weights[v, corner] = weights[(k * ny + j) * nx + i] if scene.masked else 1.0
        heaviest = max(heaviest, bench.weights[v, corner])
    if not _is_classified(several, v):
        return heaviest > 0.0
    seen, bench.opaque[v] = False, False
    for corner in range(corners):
        tint = 1.0, 1.0, 1.0
        if colors.shape[0] > 0:
            k, j, i = sample_of(shape, cell, corner)
            own = colors[(k * ny + j) * nx + i]
            tint = own[0], own[1], own[2]
        medium = medium_of_corner(scene, room, cell, corner, tint, bench.weights[v, corner])
        for channel in range(4):
            room.channels[channel, corner] = medium[channel]
            seen = seen or medium[channel] > 0.0
        bench.opaque[v] = bench.opaque[v] or isinf(medium[EXTINCTION])
    return seen


@woven_in
def _add_samples(several, v, bench, entry, leave):
    """Volume v's matter, classified at the samples, to the cubics of a piece, or to what is opaque in it."""
    channels, cubics, mixed = bench.channels[v], bench.cubics, bench.mixed
    if several.kinds[v] == LABELS:
        weight = 1.0 if bench.opaque[v] else 0.0
        for channel in range(4):
            if weight == 0.0:
                cubics[channel, :] += channels[channel, 0]
            else:
                mixed[channel] += weight if channel == EXTINCTION else channels[channel, 0]
        return
    if bench.opaque[v]:
        bench.mended[:] = channels
        channels = bench.mended
        color, weight = _opaque_color(channels, entry, leave, several.rounding[v])
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


@woven_in
def _lay_fields(several, v, bench, entry, leave):
    """Whether volume v, classified after it is interpolated, has values in a piece; its fields into `bench`."""
    room = bench_of(bench, v, 0)
    if several.kinds[v] == LABELS:
        _lay_constants(room, bench.values[v, 0], bench.weights[v, 0])
        bench.margins[v] = 0.0
        return True
    room.corners[:] = bench.values[v]
    rounding = several.rounding[v]
    if several.first[WEIGHTS, v + 1] > several.first[WEIGHTS, v]:
        middle, any_weight = _point_between(entry, leave, 0.5), False
        for corner in range(8):
            counts = bench.weights[v, corner] > 0.0 and _has_weight(corner, middle, rounding)
            any_weight = any_weight or counts
        if not any_weight:
            return False
        room.weight[0], room.weight[1], room.weight[2], room.weight[3] = trilinear(bench.weights[v], entry, leave)
    bench.margins[v] = lay_fields(room, entry, leave, rounding)
    return not isnan(bench.margins[v])


@woven_in
def _lay_constants(room, value, weight):
    """What is the same everywhere in a label's box."""
    room.corners[:] = value
    room.field[0, :] = value
    for axis in range(3):
        room.field[1 + axis, :] = room.slopes[axis, 0]
    room.weight[:] = weight


@woven_in
def _cross_in_parts(several, ray, bench, posts, here, length, depth, light):
    """Optical depth behind a piece with volumes that are classified after they are interpolated."""
    cuts, count = bench.cuts, 0
    for k in range(posts):
        v = bench.posts[k]
        count += find_cuts(scene_of(several, v), ray, bench_of(bench, v, count), here, length)
    sort_cuts(cuts, count)
    start = 0.0
    for cut in range(count):
        end = cuts[cut]
        if start < end and depth < OPAQUE_DEPTH:
            depth = _add_part(several, ray, bench, posts, start, end, here, length, depth, light)
            start = end
    return depth


@woven_in
def _add_part(several, ray, bench, posts, start, end, here, length, depth, light):
    """Optical depth behind the part from `start` to `end`, in which the same lines of transfer functions hold."""
    seen, common = 0, several.common
    for k in range(posts):
        v = bench.posts[k]
        scene, room = scene_of(several, v), bench_of(bench, v, 0)
        if not choose_between(scene, ray, room, start, end, bench.margins[v]):
            continue
        if room.chosen[OPAQUE]:
            color = opaque_at(scene, ray, room, start, end, here, length)
            for channel in range(3):
                bench.mixed[channel] += color[channel]
            bench.mixed[3] += 1.0
        else:
            bench.seen[seen] = v
            seen += 1
    if bench.mixed[3] > 0.0:
        return _add_mixed(bench, depth, light)
    if seen == 0:
        return _add_cubics(common.cued, common.cue, ray, bench.cubics, start, end, here, length, depth, light)
    bench.counts[0] = seen
    return add_interval(_collocate, several, ray, bench, start, end, here, length, depth, light)


@inlined
def _collocate(several, ray, bench, start, width, here, length, result):
    """As `collocate`, of all that is there."""
    cubics, glows, scene = bench.cubics, bench.glows, several.common
    for node in range(NODE_COUNT):
        t = start + width * NODES[node]
        color = value_at(cubics[0], t), value_at(cubics[1], t), value_at(cubics[2], t)
        extinction = value_at(cubics[3], t)
        if scene.cued:
            color = cued(scene.cue, color, extinction, cue_at(scene.cue, (here + t * length - ray.eye) * ray.along))
        glows[node, 0], glows[node, 1], glows[node, 2], glows[node, 3] = color[0], color[1], color[2], extinction
    turn = 0.0
    for k in range(bench.counts[0]):
        v = bench.seen[k]
        turn = max(turn, add_glows(scene_of(several, v), ray, bench_of(bench, v, 0), start, width, here, length))
    integrate(glows, width * length, result)
    return turn


@compiled
def _add_cubics(cued, cue, ray, cubics, start, end, here, length, depth, light):
    """Optical depth behind the part from `start` to `end` of a piece in which there are cubics alone."""
    red, green = _cubic(cubics[0], start, end), _cubic(cubics[1], start, end)
    blue, extinction = _cubic(cubics[2], start, end), _cubic(cubics[3], start, end)
    direction = (end - start) * length
    return add_cubics(cued, cue, ray, (red, green, blue), extinction, here + start * length, direction, depth, light)


@woven_in
def _cubic(row, start, end):
    return restricted((row[0], row[1], row[2], row[3]), start, end)


@woven_in
def _cue_mixed(cue, ray, bench, here):
    """What is opaque where a piece begins, under the cue."""
    mixed = bench.mixed
    color = cued(cue, (mixed[0], mixed[1], mixed[2]), mixed[3], cue_at(cue, (here - ray.eye) * ray.along))
    mixed[0], mixed[1], mixed[2] = color


@woven_in
def _add_mixed(bench, depth, light):
    """Of several opaque volumes at one place the mean colour is seen."""
    mixed = bench.mixed
    return add_opaque((mixed[0] / mixed[3], mixed[1] / mixed[3], mixed[2] / mixed[3]), depth, light)
