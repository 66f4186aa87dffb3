"""A scene of one volume with light, its rays, and the scratch memory of one thread, as arrays for compiled code.

Gradients are in *kernel units*: data units per smallest spacing, times a power of two that takes the range of the
values to about 1, so that squares of gradients neither overflow nor vanish. Thresholds are converted here, once.
Positions are in world units, relative to the centre of the scene's first volume.
"""

from __future__ import annotations

from math import frexp
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.compiling import woven_in
from texvol.ray_casting.common.lanes import LANES
from texvol.ray_casting.common.medium import Medium, medium_of
from texvol.ray_casting.common.rays import Rays, centre_from, middle_of, transformed
from texvol.ray_casting.lit.panels import Panels
from texvol.ray_casting.lit.roots import HIGHEST_DEGREE, ROW, STACK_ROWS
from texvol.ray_casting.lit.shadows import LightField
from texvol.scene.camera import Camera
from texvol.scene.gradient import gradients
from texvol.scene.lighting import DepthCue, Lighting, unit
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

HEAD, DIRECTIONAL, POINT = 0.0, 1.0, 2.0  # kinds of light, in a row of `Lights`
_KINDS = {"head": HEAD, "directional": DIRECTIONAL, "point": POINT}
_DARK = 1e-14  # of a highlight
_LEAST_FADE = 1e-300  # kernel units; so that no fade is a division by 0
NODE_COUNT = LANES  # see `collocation`
MOST_LEVELS = 200  # halvings of an interval of large optical depth
INTERVAL = 4  # numbers of an interval: optical depth and light
NO_PANELS = np.zeros((0, 2))

Numbers = NDArray[np.float64]
Triple = tuple[float, float, float]


class Lights(NamedTuple):
    """Lights, and the coefficients by which the medium reflects them."""

    # Kind, direction or position, colour, index in `transmittance` or -1, fall-off or 0: shape (n, 9).
    rows: Numbers
    ambient: float
    diffuse: float
    specular: float
    shininess: float
    two_sided: bool
    fade: float  # kernel units
    transmittance: Numbers  # of the lights that cast shadows, at the nodes of the box: shape (lights, z, y, x)
    panels: Numbers  # or along the rays, see `panels.Panels`
    column: int  # of the panels' values, the volume's first; BY_NODES if the nodes count
    box_from_world: Numbers  # world to fractions of the box edges, (3, 4)
    shadow_distance: float
    analytic: bool  # True if every kink of the light on a ray is cut: no shadows between nodes, no light near by
    dark: float  # cosine up to which a highlight, its power, shows in no digit of the oracle


class Cue(NamedTuple):
    """A depth cue; depths are along the view, in world units."""

    strength: float
    near: float
    far: float
    color: Triple


class Eye(NamedTuple):
    """Position of the eye, and the direction from the target back to it."""

    perspective: bool
    position: Triple
    backward: Triple


class Graded(NamedTuple):
    """All graded media of a transfer function; number k has the points `first[k]` to `first[k + 1]`."""

    first: NDArray[np.int64]
    values: Numbers
    emissions: Numbers
    extinctions: Numbers
    start: Numbers  # kernel units
    full: Numbers


class Gradients(NamedTuple):
    """Gradients of all samples, (z, y, x, 3), in the precision that they have: the other array is empty.

    One type for both, since the kernel for another one takes half a minute to compile.
    """

    single: NDArray[np.floating]
    double: NDArray[np.floating]

    @property
    def present(self) -> NDArray[np.floating]:
        """The one that is not empty; any, if both are."""
        return self.single if self.single.size else self.double


class LitScene(NamedTuple):
    """A scene of one volume, without samples and rays."""

    medium: Medium
    modulation: Numbers  # gradient magnitude (kernel units) and factor, shape (m, 2)
    graded: Graded
    contours: Numbers  # value, thickness × (data units per kernel unit of gradient), q, τ: shape (n, 6)
    lit: bool
    lights: Lights
    cued: bool
    cue: Cue
    eye: Eye
    uses_gradient: bool
    gradient_factor: float  # kernel units from data units per smallest spacing
    thresholds: Numbers  # squared gradient magnitudes at which the integrand has a kink, kernel units squared
    world_from_index: Numbers
    middle: Numbers  # index of the centre of the volume
    centre: Numbers  # position of that centre
    masked: bool  # True if a mask multiplies emission and extinction


def gradients_of(scene: Scene) -> Gradients:
    """Return the gradients of all samples, data units per smallest spacing; none if the scene needs none."""
    none = Gradients(np.zeros((0, 0, 0, 3), np.float32), np.zeros((0, 0, 0, 3)))
    if not scene.needs_gradient:
        return none
    found = gradients(scene.volume, scene.gradient)
    return Gradients(none.single, found) if found.dtype == np.float64 else Gradients(found, none.double)


def lit_scene(scene: CompleteScene, first: Volume, shadows: LightField) -> LitScene:
    """Return a scene of one volume as arrays; positions are relative to the centre of `first`."""
    volume, camera, transfer = scene.volume, scene.camera, scene.medium
    factor = _gradient_factor(volume)
    from_world = volume.smallest_spacing * factor  # kernel units from data units per world unit
    lights = _lights(scene.lighting, volume, first, from_world, shadows)
    modulation = np.array(np.zeros((0, 2)) if transfer.modulation is None else transfer.modulation, np.float64)
    modulation[:, 0] *= from_world
    graded = _graded(transfer, from_world)
    thresholds = np.concatenate([modulation[:, 0], graded.start, graded.full])
    if scene.lighting is not None:
        thresholds = np.append(thresholds, lights.fade)
    contours = [
        (each.value, each.thickness / from_world, *each.emission, each.extinction) for each in transfer.contours
    ]
    return LitScene(
        medium=medium_of(transfer),
        modulation=modulation,
        graded=graded,
        contours=np.array(contours, np.float64).reshape(-1, 6),
        lit=scene.lighting is not None,
        lights=lights,
        cued=scene.depth_cue is not None,
        cue=_cue(scene.depth_cue, volume, camera),
        eye=Eye(
            camera.projection == "perspective",
            _triple(np.subtract(camera.eye, first.centre)),
            _triple(-camera.forward),
        ),
        uses_gradient=scene.needs_gradient,
        gradient_factor=factor,
        thresholds=np.unique(thresholds) ** 2,
        world_from_index=np.ascontiguousarray(volume.world_from_index),
        middle=middle_of(volume),
        centre=centre_from(first, volume),
        masked=False,
    )


def _gradient_factor(volume: Volume) -> float:
    low, high = volume.finite_range or (0.0, 0.0)
    half_range = high / 2 - low / 2
    return 2.0 ** -frexp(half_range)[1] if half_range > 0 else 1.0


def _lights(lighting: Lighting | None, volume: Volume, first: Volume, from_world: float, shadows: LightField) -> Lights:
    axes = volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]
    to_box = np.column_stack([axes, 0.5 - axes @ centre_from(first, volume)])
    if lighting is None:
        none = np.zeros((0, 9)), 0.0, 0.0, 0.0, 0.0, False, 1.0
        return Lights(*none, shadows.nodes, NO_PANELS, shadows.column, to_box, 0.0, True, 0.0)
    rows = np.zeros((len(lighting.lights), 9))
    for row, light in zip(rows, lighting.lights, strict=True):
        row[0], row[4:7] = _KINDS[light.kind], light.color
        row[7] = lighting.casting.index(light) if lighting.shadows and light.kind != "head" else -1
        row[8] = light.fall_off or 0.0
        if light.vector is not None:
            row[1:4] = unit(light.vector) if light.kind == "directional" else light.vector - first.centre
    return Lights(
        rows,
        float(lighting.ambient),
        float(lighting.diffuse),
        float(lighting.specular),
        float(lighting.shininess),
        bool(lighting.two_sided),
        max(lighting.fade_for(volume) * from_world, _LEAST_FADE),
        shadows.nodes,
        NO_PANELS,
        shadows.column,
        to_box,
        shadows.distance,
        not (rows[:, 7] >= 0).any() and not (rows[:, 0] == POINT).any(),
        _DARK ** (1 / lighting.shininess) if lighting.shininess > 0 else -2.0,
    )


def _cue(cue: DepthCue | None, volume: Volume, camera: Camera) -> Cue:
    if cue is None:
        return Cue(0.0, 0.0, 1.0, (0.0, 0.0, 0.0))
    near, far = cue.range_for(volume, camera)
    return Cue(float(cue.strength), float(near), float(far), _triple(cue.color))


def _graded(transfer: TransferFunction, from_world: float) -> Graded:
    materials = transfer.graded
    first = np.cumsum([0, *(len(each.values) for each in materials)]).astype(np.int64)
    return Graded(
        first,
        np.concatenate([np.zeros(0), *(each.values for each in materials)]),
        np.concatenate([np.zeros((0, 3)), *(each.emissions for each in materials)]),
        np.concatenate([np.zeros(0), *(each.extinctions for each in materials)]),
        np.array([each.start * from_world for each in materials], np.float64),
        np.array([each.full * from_world for each in materials], np.float64),
    )


def _triple(numbers: NDArray[np.float64] | Triple) -> Triple:
    x, y, z = map(float, numbers)
    return x, y, z


class Ray(NamedTuple):
    """A ray in world units; s is 0 where the ray is nearest to the centre of the scene's first volume."""

    nearest: Triple  # position at s = 0, relative to that centre
    direction: Triple
    toward_eye: Triple  # V in the formulas of light, for positions on the ray
    eye: float  # s of the eye
    along: float  # depth along the view per unit of s
    first_panel: int  # of `Lights.panels`
    last_panel: int  # the one behind it


class Intervals(NamedTuple):
    """Scratch memory of the integral over intervals, see `collocation`."""

    glows: Numbers  # emission and extinction at the nodes, (4, nodes)
    halves: Numbers  # optical depth and light of the two halves of an interval, (2, 4)
    stack: Numbers  # intervals to be integrated: start, halvings, optical depth, light


class Workspace(NamedTuple):
    """Scratch arrays of one thread."""

    corners: Numbers  # values of a cell, (8)
    slopes: Numbers  # gradients at the corners, (3, 8)
    channels: Numbers  # emission and extinction of the corners, (4, 8)
    field: Numbers  # value and gradient along the ray, four cubics, (4, 4)
    weight: Numbers  # mask along the ray, a cubic, (4)
    square: Numbers  # |g|² along the ray, (7)
    polynomial: Numbers  # polynomial whose roots are wanted, (7)
    root_stack: Numbers
    cuts: Numbers
    chosen: NDArray[np.int64]  # segments of the transfer function, see `shading`
    intervals: Intervals


def workspace_for(most_cuts: int, most_chosen: int) -> Workspace:
    """Return a workspace for a scene of so many cuts in a cell and so many indices in `chosen`."""
    return Workspace(
        corners=np.zeros(8),
        slopes=np.zeros((3, 8)),
        channels=np.zeros((4, 8)),
        field=np.zeros((4, 4)),
        weight=np.ones(4),
        square=np.zeros(HIGHEST_DEGREE + 1),
        polynomial=np.zeros(HIGHEST_DEGREE + 1),
        root_stack=np.zeros((STACK_ROWS, ROW)),
        cuts=np.zeros(most_cuts),
        chosen=np.zeros(most_chosen, np.int64),
        intervals=Intervals(
            np.zeros((4, NODE_COUNT)), np.zeros((2, INTERVAL)), np.zeros((MOST_LEVELS + 2, 2 + INTERVAL))
        ),
    )


def world_rays(rays: Rays, volume: Volume, middle: Numbers, camera: Camera, panels: Panels | None) -> Numbers:
    """Return the 13 numbers of a `Ray` for each of `rays`; `middle` is the index of the centre of the first volume."""
    nearest = transformed(rays.start - middle, volume.world_from_index)
    along = (rays.direction * camera.forward).sum(axis=-1, keepdims=True)
    numbers = [nearest, rays.direction, -rays.direction, rays.eye[..., np.newaxis], along]
    ends = np.zeros((*along.shape[:-1], 2)) if panels is None else np.stack([panels.first, panels.end], axis=-1)
    return np.concatenate([*numbers, ends], axis=-1)


@woven_in
def ray_of(row):
    """Return the `Ray` of its numbers."""
    nearest, direction, toward_eye = (row[0], row[1], row[2]), (row[3], row[4], row[5]), (row[6], row[7], row[8])
    return Ray(nearest, direction, toward_eye, row[9], row[10], int(row[11]), int(row[12]))


@woven_in
def position_at(ray, s):
    """Return the position at s, relative to the centre of the scene's first volume, in world units."""
    return (
        ray.nearest[0] + s * ray.direction[0],
        ray.nearest[1] + s * ray.direction[1],
        ray.nearest[2] + s * ray.direction[2],
    )
