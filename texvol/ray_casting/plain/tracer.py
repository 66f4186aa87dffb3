"""Trace rays through one volume without light."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.cells import in_cell, load_corners
from texvol.ray_casting.common.compiling import compiled_and_cached, sources, uncounted, woven_in
from texvol.ray_casting.common.medium import OPAQUE_DEPTH, Medium, medium_of, segment_of
from texvol.ray_casting.common.rays import Numbers, Rays, Trace
from texvol.ray_casting.common.walk import walk_grid
from texvol.ray_casting.plain.cells import cross_postclassified, cross_preclassified
from texvol.scene.scene import CompleteScene
from texvol.util.kept_arrays import read_only


class _Ray(NamedTuple):
    """A ray in index space, the volume it crosses, and scratch memory for one cell."""

    start: Numbers
    step: Numbers
    values: NDArray
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
    medium, values = medium_of(scene.medium), scene.volume.values
    preclassified = scene.classification in ("slab", "extinction")
    values = read_only(values.astype(np.float32)) if values.dtype == np.float16 else values

    def trace(rays: Rays, picture: Numbers) -> None:
        corners, channels = np.empty(8), np.empty((4, 8))
        trace_rays(
            *(values, medium, preclassified, rays.start, rays.step, rays.ends, rounding),
            *(corners, channels, picture),
        )

    return trace
