"""The walk of a ray through several volumes at once, from one face of any cell to the next; the twin of `lit_walk`.

It does for masks, labels and colours, too, and is compiled when such a scene comes. Cells are those of `walk`, but that
one of labels reaches half a sample to each side of a sample, the (i, j, k) that it is named by.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common_positions import rays_in
from texvol.ray_casting.compiling import compiled_and_kept, sources, uncounted, woven_in
from texvol.ray_casting.lit_cuts import most_cuts
from texvol.ray_casting.lit_ray import Ray
from texvol.ray_casting.medium import OPAQUE_DEPTH
from texvol.ray_casting.several_bench import several_bench
from texvol.ray_casting.several_cells import cross
from texvol.ray_casting.several_scene import LABELS, several
from texvol.ray_casting.shading import FURTHER
from texvol.ray_casting.walk import _clipped, _first_cell, _next_cell
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction

Numbers = NDArray[np.float64]


@woven_in
def _trace(several, starts, steps, ends, ray, bench, light):
    """Optical depth of one ray, in volume v `starts[v]` + s `steps[v]`; its emission is added to `light`."""
    here, last = _find_boxes(several, starts, steps, ends, bench)
    depth = 0.0
    while here < last and depth < OPAQUE_DEPTH:
        there = _next_face(several, starts, steps, here, last, bench)
        if here < there:
            depth = cross(several, starts, steps, ray, bench, here, there, depth, light)
        _pass_faces(several, starts, steps, there, bench)
        here = max(here, there)
    return depth


@woven_in
def _find_boxes(several, starts, steps, ends, bench):
    """Where the ray enters the first box and leaves the last, between its ends; those of each in `bench.spans`."""
    first, last = np.inf, -np.inf
    for v in range(several.kinds.size):
        shape = several.shapes[v]
        enter, leave = _clipped(starts[v], steps[v], (shape[0], shape[1], shape[2]), ends)
        if not enter < leave:
            enter, leave = np.inf, -np.inf
        bench.inside[v], bench.spans[v, 0], bench.spans[v, 1] = False, enter, leave
        first, last = min(first, enter), max(last, leave)
    return first, last


@woven_in
def _next_face(several, starts, steps, here, last, bench):
    """Where the ray next enters or leaves a box, or a cell of one; boxes that begin here are entered."""
    there = last
    for v in range(several.kinds.size):
        enter, leave = bench.spans[v, 0], bench.spans[v, 1]
        if not bench.inside[v] and enter <= here + several.same:
            bench.inside[v], bench.fresh[v] = True, True
            for axis in range(3):
                start, step = _start(several, starts, v, axis), steps[v, axis]
                bench.cells[v, axis], bench.faces[v, axis] = _first_cell(start, step, max(enter, here))
        if bench.inside[v]:
            there = min(there, leave, bench.faces[v, 0], bench.faces[v, 1], bench.faces[v, 2])
        else:
            there = min(there, enter)
    return there


@woven_in
def _start(several, starts, v, axis):
    """In the coordinates in which cells have whole numbers."""
    return starts[v, axis] + (0.5 if several.kinds[v] == LABELS else 0.0)


@woven_in
def _pass_faces(several, starts, steps, there, bench):
    """Into the next cells: faces that only rounding keeps apart are passed at once."""
    there += several.same
    for v in range(several.kinds.size):
        if not bench.inside[v]:
            continue
        if bench.spans[v, 1] <= there:
            bench.inside[v], bench.spans[v, 0], bench.spans[v, 1] = False, np.inf, -np.inf
            continue
        for axis in range(3):
            if bench.faces[v, axis] <= there:
                start, cell = _start(several, starts, v, axis), bench.cells[v, axis]
                bench.cells[v, axis], bench.faces[v, axis] = _next_cell(start, steps[v, axis], cell)
                bench.fresh[v] = True


def _tracer(sources):
    @compiled_and_kept
    def trace_several_rays(several, starts, steps, ends, rays, bench, picture):
        """Light and, in the last channel, optical depth of rays, into `picture`; `rays`: the numbers of a Ray each."""
        sources  # noqa: B018 - see walk
        several, bench, picture = uncounted(several), uncounted(bench), uncounted(picture)
        starts, steps, ends = uncounted(starts), uncounted(steps), uncounted(ends)
        for row in range(picture.shape[0]):
            for column in range(picture.shape[1]):
                r = rays[row, column]
                ray = Ray((r[0], r[1], r[2]), (r[3], r[4], r[5]), (r[6], r[7], r[8]), r[9], r[10])
                start, step, light = starts[row, column], steps[row, column], picture[row, column, :3]
                picture[row, column, 3] = _trace(several, start, step, ends[row, column], ray, bench, light)

    return trace_several_rays


trace_several_rays = _tracer(sources())


def rows_tracer(
    whole: Scene, scenes: tuple[Scene, ...], transfers: list[TransferFunction], camera: Camera, rounding: Numbers
) -> Callable[[Numbers, Numbers, Numbers, Numbers, Numbers, Numbers], None]:
    """What traces rows of rays: starts and steps in the first volume's index space, as in `lit_walk`.

    Parameters
    ----------
    whole : Scene
    scenes : sequence of Scene
        The same for one volume each, see `Scene.each_alone`.
    transfers : list of TransferFunction
    rounding : array of shape (volumes, 3)
        How far rounding may have moved rays, in index space.
    """
    together, lit = several(whole, scenes, transfers, camera, rounding)
    volumes = [scene.volume for scene in scenes]
    room = sum(map(most_cuts, lit))
    chosen = max(FURTHER + 2 * len(each.graded) + len(each.contours) for each in transfers)

    def trace(
        starts: Numbers, steps: Numbers, ends: Numbers, eyes: Numbers, directions: Numbers, picture: Numbers
    ) -> None:
        nearest = (starts - lit[0].middle) @ volumes[0].world_from_index.T
        along = (directions @ camera.forward)[..., np.newaxis]
        rays = np.concatenate([nearest, directions, -directions, eyes[..., np.newaxis], along], axis=-1)
        # Of all in the same way, so that equal grids have equal faces.
        lines = [rays_in(volume, volumes[0], nearest, directions) for volume in volumes]
        all_starts, all_steps = (np.stack(each, axis=-2) for each in zip(*lines, strict=True))
        bench = several_bench(len(volumes), room, chosen)
        trace_several_rays(together, all_starts, all_steps, ends, rays, bench, picture)

    return trace
