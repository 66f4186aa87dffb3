"""The walk of a ray from cell to cell through a lit scene; the twin of `walk`, compiled when such a scene comes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.compiling import compiled_and_kept, sources, uncounted, woven_in
from texvol.ray_casting.lit_cells import cross_postclassified, cross_preclassified, load_cell
from texvol.ray_casting.lit_cuts import most_cuts
from texvol.ray_casting.lit_ray import Ray, bench_for
from texvol.ray_casting.lit_scene import gradients_of, lit_scene
from texvol.ray_casting.medium import OPAQUE_DEPTH
from texvol.ray_casting.shading import FURTHER
from texvol.ray_casting.walk import _clipped, _first_cell, _in_cell, _next_cell
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.util.kept_arrays import read_only

Numbers = NDArray[np.float64]


@woven_in
def _trace(values, gradients, scene, preclassified, start, step, ends, ray, rounding, bench, light):
    """Optical depth of one ray, `start` + s `step` for s between its ends; its emission is added to `light`."""
    here, last = _clipped(start, step, values.shape, ends)
    depth = 0.0
    if not here < last:
        return depth
    i, next_i = _first_cell(start[0], step[0], here)
    j, next_j = _first_cell(start[1], step[1], here)
    k, next_k = _first_cell(start[2], step[2], here)
    while here < last and depth < OPAQUE_DEPTH:
        there = min(next_i, next_j, next_k, last)
        cell = (i, j, k)
        if here < there and load_cell(values, gradients, scene, cell, bench):
            entry, leave = _in_cell(start, step, here, i, j, k), _in_cell(start, step, there, i, j, k)
            length = there - here
            if preclassified:
                depth = cross_preclassified(scene, ray, bench, cell, entry, leave, here, length, rounding, depth, light)
            else:
                depth = cross_postclassified(scene, ray, bench, entry, leave, here, length, rounding, depth, light)
        if next_i <= there:
            i, next_i = _next_cell(start[0], step[0], i)
        if next_j <= there:
            j, next_j = _next_cell(start[1], step[1], j)
        if next_k <= there:
            k, next_k = _next_cell(start[2], step[2], k)
        here = max(here, there)
    return depth


def _tracer(sources):
    @compiled_and_kept
    def trace_lit_rays(values, gradients, scene, preclassified, starts, steps, ends, rays, rounding, bench, picture):
        """Light and, in the last channel, optical depth of rays, into `picture`; `rays`: the numbers of a Ray each."""
        sources  # noqa: B018 - see walk
        values, gradients, picture = uncounted(values), uncounted(gradients), uncounted(picture)
        scene, bench = uncounted(scene), uncounted(bench)
        for row in range(picture.shape[0]):
            for column in range(picture.shape[1]):
                start, step, r = starts[row, column], steps[row, column], rays[row, column]
                ray = Ray((r[0], r[1], r[2]), (r[3], r[4], r[5]), (r[6], r[7], r[8]), r[9], r[10])
                light = picture[row, column, :3]
                picture[row, column, 3] = _trace(
                    values, gradients, scene, preclassified, start, step, ends[row, column], ray, rounding, bench, light
                )

    return trace_lit_rays


trace_lit_rays = _tracer(sources())


def rows_tracer(
    scene: Scene, transfer: TransferFunction, camera: Camera, rounding: Numbers
) -> Callable[[Numbers, Numbers, Numbers, Numbers, Numbers, Numbers], None]:
    """What traces rows of rays: starts and steps in index space, their ends, s of the eyes, directions, the picture."""
    lit = lit_scene(scene, transfer, camera)
    values, gradients = read_only(scene.volume.values.astype(np.float64, copy=False)), gradients_of(scene)
    preclassified = scene.classification in ("slab", "extinction")
    chosen = FURTHER + 2 * len(transfer.graded) + len(transfer.contours)

    def trace(
        starts: Numbers, steps: Numbers, ends: Numbers, eyes: Numbers, directions: Numbers, picture: Numbers
    ) -> None:
        nearest = (starts - lit.middle) @ scene.volume.world_from_index.T
        along = (directions @ camera.forward)[..., np.newaxis]
        rays = np.concatenate([nearest, directions, -directions, eyes[..., np.newaxis], along], axis=-1)
        bench = bench_for(most_cuts(lit), chosen)
        trace_lit_rays(values, gradients, lit, preclassified, starts, steps, ends, rays, rounding, bench, picture)

    return trace
