"""Trace rays through several volumes at once, from one face of any grid to the next.

The tracer also serves masks, labels and colours of one volume. Cells are those of `common.walk`; but a cell of labels
reaches half a sample to each side of a sample, whose index (i, j, k) names the cell.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from texvol.ray_casting.common.compiling import compiled, compiled_and_cached, sources, uncounted, woven_in
from texvol.ray_casting.common.medium import OPAQUE_DEPTH
from texvol.ray_casting.common.rays import Numbers, Rays, Trace, rays_in, transformed
from texvol.ray_casting.common.references import referenced, references
from texvol.ray_casting.common.walk import clipped, first_cell, next_cell, walk
from texvol.ray_casting.lit.arrays import Ray, ray_of, world_rays
from texvol.ray_casting.lit.cuts import most_cuts
from texvol.ray_casting.lit.shading import FURTHER
from texvol.ray_casting.lit.shadows import Shadows
from texvol.ray_casting.several.arrays import (
    LABELS,
    Opened,
    Several,
    SeveralWorkspace,
    open_volumes,
    samples_of,
    scene_of,
    several,
    several_workspace,
    with_panels,
    workspace_of,
)
from texvol.ray_casting.several.cells import cross
from texvol.scene.scene import CompleteScene


class _Ray(NamedTuple):
    """A ray in the index space of each volume and in the world, the volumes, and scratch memory."""

    starts: Numbers
    steps: Numbers
    world: Ray
    several: Several
    workspace: SeveralWorkspace
    light: Numbers  # sum of the emission so far, (3)


@compiled
def _find_boxes(ray, ends, progress):
    """Return the s at which a ray enters the first box and leaves the last; the s of each box go to `progress`."""
    several, first, last = ray.several, np.inf, -np.inf
    for v in range(several.kinds.size):
        shape = several.shapes[v]
        enter, leave = clipped(ray.starts[v], ray.steps[v], (shape[0], shape[1], shape[2]), ends)
        if not enter < leave:
            enter, leave = np.inf, -np.inf
        progress.inside[v], progress.spans[v, 0], progress.spans[v, 1] = False, enter, leave
        first, last = min(first, enter), max(last, leave)
    return first, last


@compiled
def _next_face(ray, progress, here, last):
    """Return the s of the next face of any box or cell; boxes that begin at `here` are entered."""
    several, there = ray.several, last
    for v in range(several.kinds.size):
        enter, leave = progress.spans[v, 0], progress.spans[v, 1]
        if not progress.inside[v] and enter <= here + several.same:
            progress.inside[v], progress.fresh[v] = True, True
            for axis in range(3):
                start, step = _start(ray, v, axis), ray.steps[v, axis]
                progress.cells[v, axis], progress.faces[v, axis] = first_cell(start, step, max(enter, here))
        if progress.inside[v]:
            there = min(there, leave, progress.faces[v, 0], progress.faces[v, 1], progress.faces[v, 2])
        else:
            there = min(there, enter)
    return there


@woven_in
def _start(ray, v, axis):
    """Return the start of a ray in coordinates in which the faces of cells are whole numbers."""
    return ray.starts[v, axis] + (0.5 if ray.several.kinds[v] == LABELS else 0.0)


@compiled
def _pass_faces(ray, progress, there):
    """Enter the next cells; faces that are apart by no more than rounding are passed at once."""
    there += ray.several.same
    for v in range(ray.several.kinds.size):
        if not progress.inside[v]:
            continue
        if progress.spans[v, 1] <= there:
            progress.inside[v], progress.spans[v, 0], progress.spans[v, 1] = False, np.inf, -np.inf
            continue
        for axis in range(3):
            if progress.faces[v, axis] <= there:
                start, cell = _start(ray, v, axis), progress.cells[v, axis]
                progress.cells[v, axis], progress.faces[v, axis] = next_cell(start, ray.steps[v, axis], cell)
                progress.fresh[v] = True
    return progress


@woven_in
def _cross(ray, progress, here, there, depth):
    """Add a piece of all volumes to a ray; return the optical depth behind it, and True if it is opaque."""
    depth = cross(ray.several, ray.starts, ray.steps, ray.world, ray.workspace, here, there, depth, ray.light)
    return depth, not depth < OPAQUE_DEPTH


def _tracer(sources):
    @compiled_and_cached
    def trace_several_rays(several, starts, steps, ends, rays, workspace, picture):
        """Write light and, in the last channel, optical depth of rays to `picture`; `rays` as `world_rays` has them."""
        sources  # noqa: B018 - see compiled_and_cached
        several, workspace, picture = referenced(several), referenced(workspace), uncounted(picture)
        count = several.kinds.size
        volumes = references(samples_of(several, 0), count)
        each, own = references(scene_of(several, 0), count), references(workspace_of(workspace, 0), count)
        open_volumes(several, workspace, volumes, each, own)
        several = referenced(
            Opened(several.kinds, several.shapes, several.scenes, several.rounding, several.same, volumes, each, own)
        )
        starts, steps, ends = uncounted(starts), uncounted(steps), uncounted(ends)
        progress = workspace.progress
        for row in range(picture.shape[0]):
            for column in range(picture.shape[1]):
                world = referenced(ray_of(rays[row, column]))
                light = picture[row, column, :3]
                ray = _Ray(starts[row, column], steps[row, column], world, several, workspace, light)
                here, last = _find_boxes(ray, ends[row, column], progress)
                picture[row, column, 3] = walk(_next_face, _pass_faces, _cross, ray, progress, here, last, 0.0)

    return trace_several_rays


trace_several_rays = _tracer(sources())


def tracer(scene: CompleteScene, rounding: Numbers, shadows: Shadows) -> Trace:
    """Return the function that traces rays of a scene, see `position_rounding` and `shadows_in`."""
    scenes, volumes = scene.each_alone(), scene.volumes
    together, lit = several(scenes, rounding, shadows.fields)
    cuts = sum(map(most_cuts, lit))
    most_chosen = max(FURTHER + 2 * len(each.medium.graded) + len(each.medium.contours) for each in scenes)

    def trace(rays: Rays, picture: Numbers) -> None:
        panels = shadows.along(rays) if shadows.along else None
        in_world = world_rays(rays, volumes[0], lit[0].middle, scene.camera, panels)
        # The rays of all volumes come from the same numbers, so that equal grids have equal faces.
        nearest = transformed(rays.start - lit[0].middle, volumes[0].world_from_index)
        of_volumes = [rays_in(volume, volumes[0], nearest, rays.direction) for volume in volumes]
        starts, steps = (np.stack(each, axis=-2) for each in zip(*of_volumes, strict=True))
        workspace = several_workspace(len(volumes), cuts, most_chosen)
        trace_several_rays(with_panels(together, panels), starts, steps, rays.ends, in_world, workspace, picture)

    return trace
