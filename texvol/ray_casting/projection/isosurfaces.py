"""Several isosurfaces of one volume: every position at which a ray passes one of the values, composited in order.

A ray passes a value where the sides of the value change, at or above it and below it; between two turns of the cubic
of a cell that happens at most once. Beside missing samples a ray has no side; where an infinite value begins or ends
it passes all values in between at once, in the order of the scene.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.bernstein import crossing, trilinear, turning_points, value_and_slope
from texvol.ray_casting.common.cells import fill, in_cell, load_corners, range_of
from texvol.ray_casting.common.compiling import ZERO, compiled, compiled_and_cached, sources, uncounted, woven_in
from texvol.ray_casting.common.rays import Choose, Numbers, Rays, Values, over_rows, position_rounding, values_of
from texvol.ray_casting.common.references import referenced
from texvol.ray_casting.common.walk import walk_grid
from texvol.ray_casting.projection.seen import depth_of, lit_color, seen_rays
from texvol.ray_casting.projection.tracer import gap_value
from texvol.scene.display import isosurface_looks
from texvol.scene.scene import CompleteScene

_FIRST_ROOM = 8  # hits of a ray that there is room for, to begin with


def surfaces_picture(
    scene: CompleteScene, size: tuple[int, int], choose: Choose, tell: Callable[[float], None]
) -> Numbers:
    """Return the picture of all isosurfaces, and meshes and lines between them, shape (height, width, 4)."""
    rays = seen_rays(scene, size, choose)
    s, numbers = _hits(scene, rays, tell)
    looks = isosurface_looks(scene)
    layers = []
    for place in range(s.shape[-1]):
        hit = np.isfinite(s[..., place])
        color = np.zeros((*hit.shape, 4))
        if hit.any():
            look = looks[numbers[..., place][hit]]
            color[hit] = np.column_stack([lit_color(scene, rays, s[..., place], hit, look[:, :3]), look[:, 3]])
        layers.append((s[..., place], color))
    return _composited(scene, rays, layers + _further(scene, size, choose, rays))


def first_depth(scene: CompleteScene, size: tuple[int, int], choose: Choose) -> Numbers:
    """Return the depth of the first isosurface along the view from the plane of the eye, shape (height, width)."""
    rays = seen_rays(scene, size, choose)
    s = _hits(scene, rays, lambda fraction: None)[0]
    first = s[..., 0] if s.shape[-1] else np.full(rays.eye.shape, np.inf)
    found = np.isfinite(first)
    return np.where(found, depth_of(scene, rays, np.where(found, first, 0.0)), np.inf)


def _further(scene: CompleteScene, size: tuple[int, int], choose: Choose, rays: Rays) -> list[tuple[Numbers, Numbers]]:
    """Return s and straight colours of meshes and lines on the rays."""
    if not scene.geometry:
        return []
    from texvol.ray_casting.surfaces.layers import surface_layers

    layers = surface_layers(scene, size, choose)
    if scene.depth is not None:
        layers = [layer.until(rays.ends[..., 1]) for layer in layers]
    return [(layer.s, layer.color) for layer in layers]


def _composited(scene: CompleteScene, rays: Rays, layers: list[tuple[Numbers, Numbers]]) -> Numbers:
    """Return layers of straight colours, each pixel's in the order of their s, in front of the background."""
    picture = np.zeros((*rays.eye.shape, 4))
    if layers:
        s = np.stack([each for each, _ in layers], axis=-1)
        order = np.argsort(s, axis=-1, kind="stable")
        colors = np.take_along_axis(np.stack([color for _, color in layers], axis=-2), order[..., np.newaxis], axis=-2)
        for place in range(s.shape[-1]):
            alpha = colors[..., place, 3:]
            light = np.concatenate([colors[..., place, :3] * alpha, alpha], axis=-1)
            picture += (1 - picture[..., 3:]) * light
    picture[..., :3] += (1 - picture[..., 3:]) * np.array(scene.background)
    return picture


def _hits(scene: CompleteScene, rays: Rays, tell: Callable[[float], None]) -> tuple[Numbers, NDArray[np.intp]]:
    """Return s, infinite behind the last, and number of the value of all hits, (height, width, n), front to back."""
    values, levels = values_of(scene.volume), np.array(scene.isovalues)
    rounding = position_rounding(scene.volume, scene.camera.eye)
    counts = np.zeros(rays.eye.shape, np.int64)
    room = _FIRST_ROOM
    while True:
        hits = np.full((*rays.eye.shape, room, 2), np.inf)

        def trace_rows(rows: slice, hits: Numbers = hits) -> None:
            scratch = np.empty(8), np.empty(len(levels))
            of_rows = rays.start[rows], rays.step[rows], rays.ends[rows]
            pass_levels(values, levels, *of_rows, rounding, *scratch, hits[rows], counts[rows])

        over_rows(trace_rows, counts.shape, tell)
        most = int(counts.max(initial=0))
        if most <= room:
            break
        room = most
    numbers = np.where(np.isfinite(hits[..., 1]), hits[..., 1], 0).astype(np.intp)
    return hits[..., :most, 0], numbers[..., :most]


class _Ray(NamedTuple):
    """A ray in index space, the volume and the values, and scratch memory."""

    start: Numbers
    step: Numbers
    values: Values
    levels: Numbers
    rounding: Numbers
    corners: Numbers  # (8)
    sides: Numbers  # of each value in front of a cell: 1, -1, or 0 where there is none
    hits: Numbers  # (room, 2)


@compiled
def side_of(above):
    """Return 1 at and above a value, -1 below it, 0 for NaN."""
    return 1.0 if above >= 0.0 else -1.0 if above < 0.0 else 0.0


@compiled
def add_hit(hits, first, count, s, level):
    """Insert a hit behind those from `first` on that are not behind it, and return the number of hits."""
    place = count
    while place > first and place - 1 < hits.shape[0] and hits[place - 1, 0] > s:
        if place < hits.shape[0]:
            hits[place, 0], hits[place, 1] = hits[place - 1, 0], hits[place - 1, 1]
        place -= 1
    if place < hits.shape[0]:
        hits[place, 0], hits[place, 1] = s, level
    return count + 1


@compiled
def pass_cell(ray, beside, entry, leave, here, length, count):
    """Add the hits in a cell that a ray crosses from s = `here` on, and return the number of hits."""
    first = count
    cubic = trilinear(ray.corners, entry, leave)
    low, high = range_of(ray.corners)
    turns = turning_points(cubic)
    for level in range(ray.levels.size):
        isovalue = ray.levels[level]
        side = side_of((beside if beside != 0.0 else value_and_slope(cubic, 0.0)[0]) - isovalue)
        if ray.sides[level] * side < 0.0:
            count = add_hit(ray.hits, first, count, here, level)
        ray.sides[level] = side
        if beside != 0.0 or low > isovalue or high < isovalue:
            continue
        start = 0.0
        for span in range(3):
            end = turns[span] if span < 2 else 1.0
            if start < end:
                now = side_of(value_and_slope(cubic, end)[0] - isovalue)
                if now != ray.sides[level]:
                    t = crossing(cubic, isovalue, start, end)
                    count = add_hit(ray.hits, first, count, here + t * length, level)
                ray.sides[level] = now
                start = end
    return count


@woven_in
def _cross(ray, cell, here, there, state):
    """Return the number of hits behind a cell; a ray never ends there."""
    load_corners(ray.values, cell.i, cell.j, cell.k, ray.corners)
    entry = in_cell(ray.start, ray.step, here, cell.i, cell.j, cell.k)
    leave = in_cell(ray.start, ray.step, there, cell.i, cell.j, cell.k)
    beside = gap_value(ray.corners, entry, leave, ray.rounding)
    if np.isnan(beside):
        fill(ray.sides, 0.0)
        return state, False
    return pass_cell(ray, beside, entry, leave, here, there - here, state), False


def _passer(sources):
    @compiled_and_cached
    def pass_levels(values, levels, starts, steps, ends, rounding, corners, sides, hits, counts):
        """Write s and number of the level of all hits of rays (rows, columns, 3) in index space to `hits`, in order.

        `counts` (rows, columns) become the numbers of hits, more than there is room for if need be; `corners` (8) and
        `sides` (levels) are scratch memory.
        """
        sources  # noqa: B018 - see compiled_and_cached
        values = referenced(values)
        volume = uncounted((values, levels, rounding, corners, sides))
        starts, steps, ends = uncounted(starts), uncounted(steps), uncounted(ends)
        hits, counts = uncounted(hits), uncounted(counts)
        for row in range(counts.shape[0]):
            for column in range(counts.shape[1]):
                fill(sides, 0.0)
                ray = _Ray(starts[row, column], steps[row, column], *volume, hits[row, column])
                counts[row, column] = walk_grid(_cross, ray, values.shape, ends[row, column], ZERO)

    return pass_levels


pass_levels = _passer(sources())
