"""Trace rays through one volume with light, a depth cue or a medium that depends on the gradient."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from texvol.ray_casting.common.cells import in_cell
from texvol.ray_casting.common.compiling import compiled_and_cached, sources, uncounted, woven_in
from texvol.ray_casting.common.medium import OPAQUE_DEPTH
from texvol.ray_casting.common.rays import Numbers, Rays, Trace
from texvol.ray_casting.common.references import referenced
from texvol.ray_casting.common.walk import walk_grid
from texvol.ray_casting.lit.arrays import (
    NO_PANELS,
    Gradients,
    LitScene,
    Ray,
    Workspace,
    gradients_of,
    lit_scene,
    ray_of,
    workspace_for,
    world_rays,
)
from texvol.ray_casting.lit.cells import cross_postclassified, cross_preclassified, load_cell
from texvol.ray_casting.lit.cuts import most_cuts
from texvol.ray_casting.lit.shading import FURTHER
from texvol.ray_casting.lit.shadows import Shadows
from texvol.scene.scene import CompleteScene
from texvol.util.kept_arrays import read_only


class _Ray(NamedTuple):
    """A ray in index space and in the world, the scene it crosses, and scratch memory."""

    start: Numbers
    step: Numbers
    world: Ray
    values: Numbers
    gradients: Gradients
    scene: LitScene
    preclassified: bool
    rounding: Numbers
    workspace: Workspace
    light: Numbers  # sum of the emission so far, (3)


@woven_in
def _cross(ray, cell, here, there, depth):
    """Add one cell to the light of a ray; return the optical depth behind it, and True if it is opaque."""
    i, j, k = cell.i, cell.j, cell.k
    scene, world, workspace, rounding, light = ray.scene, ray.world, ray.workspace, ray.rounding, ray.light
    index = (i, j, k)
    if load_cell(ray.values, ray.gradients, scene, index, workspace):
        entry, leave = in_cell(ray.start, ray.step, here, i, j, k), in_cell(ray.start, ray.step, there, i, j, k)
        length = there - here
        if ray.preclassified:
            depth = cross_preclassified(
                scene, world, workspace, index, entry, leave, here, length, rounding, depth, light
            )
        else:
            depth = cross_postclassified(scene, world, workspace, entry, leave, here, length, rounding, depth, light)
    return depth, not depth < OPAQUE_DEPTH


def _tracer(sources):
    @compiled_and_cached
    def trace_lit_rays(
        values, gradients, scene, preclassified, starts, steps, ends, rays, rounding, workspace, picture
    ):
        """Write light and, in the last channel, optical depth of rays to `picture`; `rays` as `world_rays` has them."""
        sources  # noqa: B018 - see compiled_and_cached
        volume = uncounted(
            (values, referenced(gradients), referenced(scene), preclassified, rounding, referenced(workspace))
        )
        starts, steps, ends, picture = uncounted(starts), uncounted(steps), uncounted(ends), uncounted(picture)
        for row in range(picture.shape[0]):
            for column in range(picture.shape[1]):
                world = referenced(ray_of(rays[row, column]))
                light = picture[row, column, :3]
                ray = _Ray(starts[row, column], steps[row, column], world, *volume, light)
                picture[row, column, 3] = walk_grid(_cross, ray, values.shape, ends[row, column], 0.0)

    return trace_lit_rays


trace_lit_rays = _tracer(sources())


def tracer(scene: CompleteScene, rounding: Numbers, shadows: Shadows) -> Trace:
    """Return the function that traces rays of a scene, see `position_rounding` and `shadows_in`."""
    lit = lit_scene(scene, scene.volume, shadows.fields[0])
    values, gradients = read_only(scene.volume.values.astype(np.float64, copy=False)), gradients_of(scene)
    preclassified = scene.classification in ("slab", "extinction")
    most_chosen = FURTHER + 2 * len(scene.medium.graded) + len(scene.medium.contours)

    def trace(rays: Rays, picture: Numbers) -> None:
        panels = shadows.along(rays) if shadows.along else None
        in_world = world_rays(rays, scene.volume, lit.middle, scene.camera, panels)
        lights = lit.lights._replace(panels=NO_PANELS if panels is None else panels.rows)
        workspace = workspace_for(most_cuts(lit), most_chosen)
        trace_lit_rays(
            *(values, gradients, lit._replace(lights=lights), preclassified),
            *(rays.start, rays.step, rays.ends, in_world, rounding, workspace, picture),
        )

    return trace
