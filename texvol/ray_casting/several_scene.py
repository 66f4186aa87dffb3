"""What the oracle has to know of scenes with several volumes, masks, labels or colours, as arrays.

What volumes have of different lengths lies one behind the other: that of volume v from `first[what, v]` to
`first[what, v + 1]`. So the same compiled code does for any number of volumes. `scene_of` puts together the `LitScene`
of one of them. Places are world units relative to the centre of the first.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.bernstein import EPSILON
from texvol.ray_casting.compiling import inlined, woven_in
from texvol.ray_casting.lit_scene import Graded, Lights, LitScene, gradients_of, lit_scene
from texvol.ray_casting.medium import Medium
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction

# How a volume becomes matter: its samples do, and are interpolated; values are, and do; or the nearest sample does.
PRECLASSIFIED, POSTCLASSIFIED, LABELS = 0, 1, 2
# What may be of different lengths. GRADED_FIRST is one longer than GRADED, for each volume.
VALUES, WEIGHTS, COLORS, GRADIENTS, POINTS, SEGMENTS, MODULATION, CONTOURS = range(8)
GRADED, GRADED_FIRST, GRADED_VALUES, THRESHOLDS, LIGHT_TRANSMITTANCE = range(8, 13)

Numbers = NDArray[np.float64]
Indices = NDArray[np.int64]


class Several(NamedTuple):
    """All volumes of a scene, and what they have in common."""

    kinds: Indices
    shapes: Indices  # (volumes, 3): z, y, x
    first: Indices  # (what, volumes + 1)
    values: Numbers
    weights: Numbers  # of masks; none where there is no mask
    colors: Numbers  # of samples, (n, 3); none where they have none
    gradients: Numbers  # (n, 3); none where they are not needed
    points: Numbers
    point_colors: Numbers
    extinctions: Numbers
    emissive: NDArray[np.bool_]
    glows: NDArray[np.bool_]
    visible_before: Indices
    modulation: Numbers
    contours: Numbers
    graded_first: Indices
    graded_values: Numbers
    graded_emissions: Numbers
    graded_extinctions: Numbers
    graded_start: Numbers
    graded_full: Numbers
    fades: Numbers
    boxes_from_world: Numbers
    light_transmittance: Numbers
    nodes: Indices  # of that, (volumes, 4): lights, z, y, x
    shadow_distances: Numbers
    uses_gradient: NDArray[np.bool_]
    gradient_factors: Numbers
    thresholds: Numbers
    axes: Numbers  # (volumes, 3, 3)
    middles: Numbers
    centres: Numbers
    rounding: Numbers  # how far a ray may be off, in index space, (volumes, 3)
    common: LitScene  # that of the first volume: lights, cue and eye are those of all
    same: float  # places on a ray that are nearer to each other are the same but for rounding


def several(
    whole: Scene, scenes: Sequence[Scene], transfers: Sequence[TransferFunction], camera: Camera, rounding: Numbers
) -> tuple[Several, list[LitScene]]:
    """A scene as compiled code takes it, and each of its volumes by itself; `scenes` are those of one volume each."""
    lit = [lit_scene(s, t, camera, whole) for s, t in zip(scenes, transfers, strict=True)]
    volumes = [scene.volume for scene in scenes]
    radius = max(float(np.linalg.norm(each.centre)) + v.radius for each, v in zip(lit, volumes, strict=True))
    samples, medium = _samples_of_all(scenes), _medium_of_all(lit)
    numbers: dict[str, NDArray] = {name: np.concatenate(parts) for name, parts in (samples | medium).items()}
    together = Several(
        kinds=np.array([_kind(scene) for scene in scenes]),
        shapes=np.array([volume.values.shape for volume in volumes]),
        first=_firsts([*samples.values(), *(medium[each] for each in _LENGTHS_OF_MEDIUM)]),
        **numbers,
        emissive=np.array([each.medium.emissive for each in lit]),
        glows=np.array([each.medium.glows for each in lit]),
        fades=np.array([each.lights.fade for each in lit]),
        nodes=np.array([each.lights.light_transmittance.shape for each in lit]),
        boxes_from_world=np.stack([each.lights.box_from_world for each in lit]),
        shadow_distances=np.array([each.lights.shadow_distance for each in lit]),
        uses_gradient=np.array([each.uses_gradient for each in lit]),
        gradient_factors=np.array([each.gradient_factor for each in lit]),
        axes=np.stack([each.world_from_index for each in lit]),
        middles=np.stack([each.middle for each in lit]),
        centres=np.stack([each.centre for each in lit]),
        rounding=rounding,
        common=lit[0],
        same=16 * EPSILON * radius,
    )
    return together, lit


def _kind(scene: Scene) -> int:
    if scene.volume.labels:
        return LABELS
    before = scene.classification in ("slab", "extinction") or scene.volume.colors is not None
    return PRECLASSIFIED if before else POSTCLASSIFIED


def _samples_of_all(scenes: Sequence[Scene]) -> dict[str, list[NDArray]]:
    """What there is for each sample, in the order from VALUES on."""
    none, volumes = np.zeros((0, 3)), [scene.volume for scene in scenes]
    return {
        "values": [volume.values.reshape(-1).astype(np.float64) for volume in volumes],
        "weights": [none[:, 0] if s.mask is None else s.mask.array.reshape(-1).astype(np.float64) for s in scenes],
        "colors": [
            none if volume.colors is None else volume.colors.reshape(-1, 3).astype(np.float64) for volume in volumes
        ],
        "gradients": [
            gradients_of(scene).reshape(-1, 3).astype(np.float64) if scene.needs_gradient else none for scene in scenes
        ],
    }


# Of what lengths are to be had, in the order from POINTS on.
_LENGTHS_OF_MEDIUM = (
    *("points", "visible_before", "modulation", "contours"),
    *("graded_start", "graded_first", "graded_values", "thresholds", "light_transmittance"),
)


def _medium_of_all(lit: Sequence[LitScene]) -> dict[str, list[NDArray]]:
    """What matter there is, by the names of its fields."""
    media, graded = [each.medium for each in lit], [each.graded for each in lit]
    return {
        "points": [medium.points for medium in media],
        "point_colors": [medium.colors for medium in media],
        "extinctions": [medium.extinctions for medium in media],
        "visible_before": [medium.visible_before for medium in media],
        "modulation": [each.modulation for each in lit],
        "contours": [each.contours for each in lit],
        "graded_first": [each.first for each in graded],
        "graded_values": [each.values for each in graded],
        "graded_emissions": [each.emissions for each in graded],
        "graded_extinctions": [each.extinctions for each in graded],
        "graded_start": [each.start for each in graded],
        "graded_full": [each.full for each in graded],
        "thresholds": [each.thresholds for each in lit],
        "light_transmittance": [each.lights.light_transmittance.reshape(-1) for each in lit],
    }


def _firsts(parts: Sequence[Sequence[NDArray]]) -> Indices:
    """Where that of each volume begins, and the last one's ends."""
    lengths = np.array([[len(part) for part in parts_of_one] for parts_of_one in parts], np.int64)
    return np.concatenate([np.zeros((len(lengths), 1), np.int64), np.cumsum(lengths, axis=1)], axis=1)


@woven_in
def part_of(several, what, v, array):
    """What of an array belongs to volume v."""
    return array[several.first[what, v] : several.first[what, v + 1]]


@inlined
def scene_of(several, v):
    """The `LitScene` of volume v."""
    common, lights = several.common, several.common.lights
    medium = Medium(
        part_of(several, POINTS, v, several.points),
        part_of(several, POINTS, v, several.point_colors),
        part_of(several, POINTS, v, several.extinctions),
        several.emissive[v],
        several.glows[v],
        part_of(several, SEGMENTS, v, several.visible_before),
    )
    shining = (lights.ambient, lights.diffuse, lights.specular, lights.shininess, lights.two_sided, several.fades[v])
    nodes = several.nodes[v]
    light_transmittance = part_of(several, LIGHT_TRANSMITTANCE, v, several.light_transmittance).reshape(
        (nodes[0], nodes[1], nodes[2], nodes[3])
    )
    of_box = (light_transmittance, several.boxes_from_world[v], several.shadow_distances[v])
    answering = Lights(lights.rows, *shining, *of_box)
    eye = (common.lit, answering, common.cued, common.cue, common.eye)
    gradient = (
        several.uses_gradient[v],
        several.gradient_factors[v],
        part_of(several, THRESHOLDS, v, several.thresholds),
    )
    masked = several.first[WEIGHTS, v + 1] > several.first[WEIGHTS, v]
    return LitScene(
        medium,
        part_of(several, MODULATION, v, several.modulation),
        _graded_of(several, v),
        part_of(several, CONTOURS, v, several.contours),
        *eye,
        *gradient,
        several.axes[v],
        several.middles[v],
        several.centres[v],
        masked,
    )


@woven_in
def _graded_of(several, v):
    return Graded(
        part_of(several, GRADED_FIRST, v, several.graded_first),
        part_of(several, GRADED_VALUES, v, several.graded_values),
        part_of(several, GRADED_VALUES, v, several.graded_emissions),
        part_of(several, GRADED_VALUES, v, several.graded_extinctions),
        part_of(several, GRADED, v, several.graded_start),
        part_of(several, GRADED, v, several.graded_full),
    )
