"""Scenes with several volumes, masks, labels or colours, and scratch memory, as arrays for compiled code.

The parts of the volumes are stacked, so that the same compiled code serves any number of volumes: a number of each
volume becomes an array, and arrays of different lengths lie one behind the other (`Ragged`). `scene_of` returns the
`LitScene` of one volume, `workspace_of` its `Workspace`. Positions are in world units, relative to the centre of the
first volume.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.bernstein import EPSILON
from texvol.ray_casting.common.compiling import compiled, woven_in
from texvol.ray_casting.common.medium import Medium
from texvol.ray_casting.common.rays import Numbers
from texvol.ray_casting.lit.arrays import (
    NO_PANELS,
    Graded,
    Gradients,
    Intervals,
    Lights,
    LitScene,
    Workspace,
    gradients_of,
    lit_scene,
    workspace_for,
)
from texvol.ray_casting.lit.panels import Panels
from texvol.ray_casting.lit.shadows import LightField
from texvol.scene.scene import CompleteScene, Scene

# Order of classification and interpolation: samples are classified first, values are interpolated first, or the
# nearest sample counts.
PRECLASSIFIED, POSTCLASSIFIED, LABELS = 0, 1, 2

Indices = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Ragged(NamedTuple):
    """Arrays of different lengths, one behind the other: array v is `numbers[first[v] : first[v + 1]]`."""

    numbers: NDArray
    first: Indices


class Samples(NamedTuple):
    """Samples of all volumes, z, y, x flattened."""

    values: Ragged
    weights: Ragged  # of masks; empty for a volume without mask
    colors: Ragged  # (n, 3); empty for a volume without colours
    gradients: Ragged  # (n, 3); empty for a volume that needs none


class Several(NamedTuple):
    """All volumes of a scene."""

    kinds: Indices  # PRECLASSIFIED, POSTCLASSIFIED or LABELS
    shapes: Indices  # (volumes, 3): z, y, x
    samples: Samples
    scenes: Any  # a LitScene; fields that depend on the volume are Ragged, or have a first axis of volumes
    nodes: Indices  # shapes of `scenes.lights.transmittance`, (volumes, 4): lights, z, y, x
    rounding: Numbers  # possible error of rays in index space, (volumes, 3)
    same: float  # two faces on a ray that are nearer to each other than this are one face


def several(
    scenes: Sequence[CompleteScene], rounding: Numbers, shadows: Sequence[LightField]
) -> tuple[Several, list[LitScene]]:
    """Return scenes of one volume each as arrays, and the `LitScene` of each; see `several.tracer.tracer`."""
    lit = [lit_scene(scene, scenes[0].volume, field) for scene, field in zip(scenes, shadows, strict=True)]
    volumes = [scene.volume for scene in scenes]
    radius = max(float(np.linalg.norm(each.centre)) + v.radius for each, v in zip(lit, volumes, strict=True))
    together = Several(
        kinds=np.array([_kind(scene) for scene in scenes]),
        shapes=np.array([volume.values.shape for volume in volumes]),
        samples=Samples(*map(_ragged, zip(*map(_samples_of, scenes), strict=True))),
        scenes=_stacked_scenes(lit)._replace(masked=np.array([scene.mask is not None for scene in scenes])),
        nodes=np.array([each.lights.transmittance.shape for each in lit]),
        rounding=rounding,
        same=16 * EPSILON * radius,
    )
    return together, lit


def with_panels(together: Several, panels: Panels | None) -> Several:
    """Return the scenes with the light along some rays."""
    lights = together.scenes.lights._replace(panels=NO_PANELS if panels is None else panels.rows)
    return together._replace(scenes=together.scenes._replace(lights=lights))


def _kind(scene: Scene) -> int:
    if scene.volume.nearest:
        return LABELS
    before = scene.classification in ("slab", "extinction") or scene.volume.colors is not None
    return PRECLASSIFIED if before else POSTCLASSIFIED


def _samples_of(scene: Scene) -> tuple[NDArray, ...]:
    """Return the samples of one volume, in the order of `Samples`."""
    volume, none = scene.volume, np.zeros((0, 3))
    return (
        volume.values.reshape(-1).astype(np.float64),
        none[:, 0] if scene.mask is None else scene.mask.array.reshape(-1).astype(np.float64),
        none if volume.colors is None else volume.colors.reshape(-1, 3).astype(np.float64),
        gradients_of(scene).present.reshape(-1, 3).astype(np.float64),
    )


def _stacked_scenes(lit: Sequence[LitScene]) -> Any:
    """Return the scene of all volumes: fields that are the same for all volumes are those of the first."""
    first: Any = lit[0]  # numba infers the types of the fields
    lights = [each.lights for each in lit]
    return first._replace(
        medium=_stacked([each.medium for each in lit]),
        modulation=_ragged([each.modulation for each in lit]),
        graded=_stacked([each.graded for each in lit]),
        contours=_ragged([each.contours for each in lit]),
        lights=first.lights._replace(
            fade=np.array([each.fade for each in lights]),
            transmittance=_ragged([each.transmittance.reshape(-1) for each in lights]),
            box_from_world=np.stack([each.box_from_world for each in lights]),
            shadow_distance=np.array([each.shadow_distance for each in lights]),
            column=np.array([each.column for each in lights]),
        ),
        uses_gradient=np.array([each.uses_gradient for each in lit]),
        gradient_factor=np.array([each.gradient_factor for each in lit]),
        thresholds=_ragged([each.thresholds for each in lit]),
        world_from_index=np.stack([each.world_from_index for each in lit]),
        middle=np.stack([each.middle for each in lit]),
        centre=np.stack([each.centre for each in lit]),
    )


def _stacked(parts: Sequence[Any]) -> Any:
    """Return a named tuple of the same type: Ragged for fields that are arrays, arrays for fields that are numbers."""
    fields = zip(*parts, strict=True)
    return type(parts[0])(*(_ragged(each) if isinstance(each[0], np.ndarray) else np.array(each) for each in fields))


def _ragged(arrays: Sequence[NDArray]) -> Any:
    return Ragged(np.concatenate(arrays), np.cumsum([0, *map(len, arrays)]).astype(np.int64))


@woven_in
def part_of(ragged, v):
    """Return the array of volume v."""
    return ragged.numbers[ragged.first[v] : ragged.first[v + 1]]


@woven_in
def scene_of(several, v):
    """Return the `LitScene` of volume v."""
    scenes = several.scenes
    return LitScene(
        _medium_of(scenes.medium, v),
        part_of(scenes.modulation, v),
        _graded_of(scenes.graded, v),
        part_of(scenes.contours, v),
        scenes.lit,
        _lights_of(several, v),
        scenes.cued,
        scenes.cue,
        scenes.eye,
        scenes.uses_gradient[v],
        scenes.gradient_factor[v],
        part_of(scenes.thresholds, v),
        scenes.world_from_index[v],
        scenes.middle[v],
        scenes.centre[v],
        scenes.masked[v],
    )


@woven_in
def _medium_of(media, v):
    return Medium(
        part_of(media.points, v),
        part_of(media.colors, v),
        part_of(media.extinctions, v),
        media.emissive[v],
        media.glows[v],
        part_of(media.visible_before, v),
    )


@woven_in
def _graded_of(graded, v):
    return Graded(
        part_of(graded.first, v),
        part_of(graded.values, v),
        part_of(graded.emissions, v),
        part_of(graded.extinctions, v),
        part_of(graded.start, v),
        part_of(graded.full, v),
    )


@woven_in
def _lights_of(several, v):
    lights, nodes = several.scenes.lights, several.nodes[v]
    return Lights(
        lights.rows,
        lights.ambient,
        lights.diffuse,
        lights.specular,
        lights.shininess,
        lights.two_sided,
        lights.fade[v],
        part_of(lights.transmittance, v).reshape((nodes[0], nodes[1], nodes[2], nodes[3])),
        lights.panels,
        lights.column[v],
        lights.box_from_world[v],
        lights.shadow_distance[v],
        lights.analytic,
        lights.dark,
    )


class OwnSamples(NamedTuple):
    """Samples of one volume, see `Samples`."""

    values: Numbers  # z, y, x
    gradients: Gradients
    weights: Numbers
    colors: Numbers


@woven_in
def samples_of(several, v):
    """Return the samples of volume v."""
    samples, shape = several.samples, several.shapes[v]
    slopes = part_of(samples.gradients, v)
    slopes = slopes.reshape((shape[0] if slopes.shape[0] > 0 else 0, shape[1], shape[2], 3))
    return OwnSamples(
        part_of(samples.values, v).reshape((shape[0], shape[1], shape[2])),
        Gradients(slopes, slopes),
        part_of(samples.weights, v),
        part_of(samples.colors, v),
    )


class Opened(NamedTuple):
    """All volumes of a scene in compiled code; see `Several`."""

    kinds: Indices
    shapes: Indices
    scenes: Any
    rounding: Numbers
    same: float
    volumes: Any  # references to the samples of each volume,
    each: Any  # to the `LitScene` of each
    own: Any  # and to the `Workspace` of each


@compiled
def open_volumes(several, workspace, volumes, each, own):
    """Write samples, scene and workspace of each volume to references."""
    for v in range(several.kinds.size):
        volumes[v], each[v], own[v] = samples_of(several, v), scene_of(several, v), workspace_of(workspace, v)


class Progress(NamedTuple):
    """How far a ray is in the grid of each volume."""

    spans: Numbers  # s where the ray enters and leaves the box, (volumes, 2); the first is larger behind the box
    inside: Flags  # True while the ray is in the box
    cells: Indices  # the cell that the ray is in, (volumes, 3)
    faces: Numbers  # s where the ray leaves the cell along each axis, (volumes, 3)
    fresh: Flags  # True if the samples of the cell have not been loaded yet


class CellSamples(NamedTuple):
    """Samples of the present cell of each volume."""

    visible: Flags  # True if the cell may show anything
    opaque: Flags  # True if any sample is opaque
    values: Numbers  # (volumes, 8)
    weights: Numbers  # of the mask, (volumes, 8)


class SeveralWorkspace(NamedTuple):
    """Scratch memory of one thread."""

    progress: Progress
    samples: CellSamples
    each: Workspace  # the arrays of a cell and its fields have a first axis of volumes; the others are shared
    intervals: Intervals  # the same as `each.intervals`
    margins: Numbers  # values nearer to each other than this may be one value before rounding, (volumes)
    posts: Indices  # volumes in a piece that are classified after interpolation
    seen: Indices  # volumes of `posts` that show in a part of the piece
    counts: Indices  # length of `seen`, (1)
    cubics: Numbers  # emission and extinction of all other volumes together, (4, 4)
    mixed: Numbers  # colour and weight of opaque volumes at one position, (4)
    mended: Numbers  # `channels` of one volume, without the opaque corners that have no weight, (4, 8)


def several_workspace(volumes: int, most_cuts: int, most_chosen: int) -> SeveralWorkspace:
    """Return a workspace for so many volumes, cuts in a piece, and indices in `chosen`."""

    def numbers(*shape: int) -> Numbers:
        return np.zeros((volumes, *shape))

    def flags() -> Flags:
        return np.zeros(volumes, np.bool_)

    def indices(*shape: int) -> Indices:
        return np.zeros((volumes, *shape), np.int64)

    one = workspace_for(most_cuts, most_chosen)
    return SeveralWorkspace(
        progress=Progress(numbers(2), flags(), indices(3), numbers(3), flags()),
        samples=CellSamples(flags(), flags(), numbers(8), numbers(8)),
        each=one._replace(
            corners=numbers(8),
            slopes=numbers(3, 8),
            channels=numbers(4, 8),
            field=numbers(4, 4),
            weight=numbers(4),
            chosen=indices(most_chosen),
        ),
        intervals=one.intervals,
        margins=numbers(),
        posts=indices(),
        seen=indices(),
        counts=np.zeros(1, np.int64),
        cubics=np.zeros((4, 4)),
        mixed=np.zeros(4),
        mended=np.zeros((4, 8)),
    )


@woven_in
def workspace_of(workspace, v):
    """Return the `Workspace` of volume v."""
    each = workspace.each
    return Workspace(
        each.corners[v],
        each.slopes[v],
        each.channels[v],
        each.field[v],
        each.weight[v],
        each.square,
        each.polynomial,
        each.root_stack,
        each.cuts,
        each.chosen[v],
        each.intervals,
    )
