"""Matter and light at the samples: what `slab` and `extinction` store where something depends on the gradient.

Each sample is classified by its value and gradient, and lit where it lies, as it is seen from the eye; what is between
is interpolated (Gouraud 1971). So texels that are lit are made anew for another eye.

Vectors are of shape (3, n), or (3, 1) where one stands for all. Directions have the gradients' precision, single where
values have no more; positions are float64.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.gradient import Box, gradients
from texvol.scene.lighting import MOST, Light, Lighting, depends_on_eye, position_of, shadow_distance, unit
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.transfer import Classified
from texvol.scene.volume import Volume
from texvol.textures.visible_values import visible

Numbers = NDArray[np.floating[Any]]
LightTransmittance = NDArray[np.float32]  # at nodes (z, y, x), of each light that casts shadows: from 0 to 1
# Cosine under which two directions are square to each other but for rounding: a surface then has no side to turn.
_SQUARE = 1e-6


def medium_of_samples(
    scene: CompleteScene, light_transmittance: LightTransmittance | None, box: Box, gradient_step: float = 0.0
) -> tuple[NDArray[np.intp], Classified]:
    """Return the flat indices of the samples of a box that show, ascending, and their lit emission and extinction.

    Emission, shape (n, 3), and extinction are per world unit; where the extinction is infinite the emission is the
    colour that shows. `light_transmittance` is what shadows leave of each light, see `texvol.opengl.shadows`.
    Components of gradients are rounded to multiples of `gradient_step`, data units per smallest spacing, unless 0.
    """
    volume, transfer_function = scene.volume, scene.medium
    values = volume.values[box]
    is_shown = visible(volume, transfer_function, values)
    if scene.mask is not None:
        is_shown &= ~scene.mask.hidden[box]
    shows = np.flatnonzero(is_shown)
    if not shows.size:
        return shows, Classified(np.zeros((0, 3)), np.zeros(0))
    if not (scene.lighting or transfer_function.needs_gradient):
        return shows, _there(scene, transfer_function.classify(values.reshape(-1)[shows]), box, shows)
    slopes, index = _slopes_at(scene, box, is_shown)
    if gradient_step:
        slopes = np.rint(slopes / gradient_step) * gradient_step
    normals, magnitudes = _directions(slopes, volume.smallest_spacing)
    shown = values.reshape(-1)[shows]
    medium = transfer_function.classify(shown, magnitudes if transfer_function.needs_gradient else None)
    medium = _there(scene, medium, box, shows)
    lighting = scene.lighting
    if lighting is None:
        return shows, medium
    diffuse, highlight = _shade(scene, lighting, normals, magnitudes, index, light_transmittance)
    glow = medium.emission * diffuse
    if highlight is not None:
        glow += np.where(np.isinf(medium.extinction), 1.0, medium.extinction)[:, np.newaxis] * highlight
    return shows, Classified(glow, medium.extinction)


def needs_samples(scene: CompleteScene) -> bool:
    """True if the medium at a sample depends on more than its value."""
    fades = scene.mask is not None and scene.mask.array.dtype != np.bool_
    return bool(scene.lighting or scene.medium.needs_gradient or scene.volume.colors is not None or fades)


def _there(scene: Scene, medium: Classified, box: Box, shows: NDArray[np.intp]) -> Classified:
    """Matter of the shown samples of a box in their own colours, and as much of it as the mask leaves."""
    emission, extinction = medium
    if scene.volume.colors is not None:
        emission = emission * scene.volume.colors[box].reshape(-1, 3)[shows]
    if scene.mask is not None and scene.mask.array.dtype != np.bool_:
        weights = scene.mask.array[box].reshape(-1)[shows]
        opaque = np.isinf(extinction)  # is so however little of it there is, and shows its colour
        emission = emission * np.where(opaque, 1.0, weights)[:, np.newaxis]
        extinction = extinction * np.where(opaque, 1.0, weights)
    return Classified(emission, extinction)


def _slopes_at(scene: Scene, box: Box, is_shown: NDArray[np.bool_]) -> tuple[Numbers, NDArray[np.intp]]:
    """Gradients at the shown samples of a box, data units per smallest spacing, and the samples' indices x, y, z.

    Both of shape (3, n). Gradients are made no farther around than something shows.
    """
    shape = scene.volume.shape
    starts = [part.indices(count)[0] for part, count in zip(box, shape, strict=True)]
    ends = []
    for axis in range(3):
        anywhere = np.flatnonzero(is_shown.any(axis=tuple(other for other in range(3) if other != axis)))
        ends.append((int(anywhere[0]), int(anywhere[-1]) + 1))
    inner = tuple(slice(first, last) for first, last in ends)
    z, y, x = (slice(start + first, start + last) for start, (first, last) in zip(starts, ends, strict=True))
    within = is_shown[inner]
    found = gradients(scene.volume, scene.gradient, (z, y, x))
    slopes = np.ascontiguousarray(found.reshape(-1, 3)[np.flatnonzero(within)].T)
    index = np.array(np.nonzero(within)[::-1]) + np.array([[x.start], [y.start], [z.start]])
    return slopes, index


def _directions(slopes: Numbers, smallest_spacing: float) -> tuple[Numbers, NDArray[np.float64]]:
    """The normals, from high values to low ones, of length 1 or 0; and |gradient| per world unit, shape (n,)."""
    # Relative to the largest component, whose square would else be no number.
    largest = np.abs(slopes).max(axis=0)
    slopes /= -np.where(largest > 0, largest, 1)
    length = np.sqrt(_dot(slopes, slopes))
    slopes /= np.where(length > 0, length, 1)
    return slopes, largest.astype(np.float64) * length / smallest_spacing


def _shade(
    scene: CompleteScene,
    lighting: Lighting,
    normals: Numbers,
    magnitudes: NDArray[np.float64],
    index: NDArray[np.intp],
    light_transmittance: LightTransmittance | None,
) -> tuple[Numbers, Numbers | None]:
    """Return D and S of `texvol.scene.lighting`, both (n, 3), of samples with gradient `magnitudes` per world unit.

    S is None where nothing has highlights.
    """
    volume, camera = scene.volume, scene.camera
    positions = None  # relative to the middle of the box
    sees_positions = camera.projection == "perspective" and depends_on_eye(lighting)
    if sees_positions or light_transmittance is not None or any(light.kind == "point" for light in lighting.lights):
        positions = volume.world_from_index @ (index - (np.array(volume.dimensions)[:, np.newaxis] - 1) / 2)
    with np.errstate(over="ignore"):
        fraction = np.minimum(magnitudes / lighting.fade_for(volume), 1).astype(normals.dtype)
    confidence = fraction * fraction * (3 - 2 * fraction)
    to_eye = _to_eye(volume, camera, positions) if depends_on_eye(lighting) else np.zeros((3, 1))
    if lighting.two_sided:
        normals = np.where(_dot(normals, to_eye) < -_SQUARE, -normals, normals)
    falls, shines = [], []
    ambient, diffuse, specular, shininess = (
        min(number, MOST) for number in (lighting.ambient, lighting.diffuse, lighting.specular, lighting.shininess)
    )
    for light in lighting.lights:
        to_light = _to_light(light, volume, to_eye, positions)
        facing = _dot(normals, to_light)
        fall = 1 - confidence + confidence * np.maximum(facing, 0)
        left: Numbers | float = 1.0
        if light_transmittance is not None and light.kind != "head":
            assert positions is not None
            nodes = light_transmittance[..., lighting.casting.index(light)]
            left = _left_at(nodes, volume, positions + shadow_distance(volume) * to_light).astype(normals.dtype)
        if light.fall_off is not None:
            assert positions is not None
            distance = np.linalg.norm(position_of(light, volume)[:, np.newaxis] - positions, axis=0)
            left = left * (light.fall_off / (light.fall_off + distance)).astype(normals.dtype)
        falls.append(fall * left)
        if lighting.specular > 0:
            halfway = np.maximum(_dot(normals, _unit(to_light + to_eye)), 0)
            shines.append(np.where(facing > _SQUARE, confidence * halfway**shininess, 0) * left)
    bright = np.array([light.color for light in lighting.lights]).reshape(-1, 3)
    colors = np.minimum(bright, MOST).astype(normals.dtype)
    falling = ambient + diffuse * _in_colors(falls, colors, magnitudes.size)
    return falling, specular * _in_colors(shines, colors, magnitudes.size) if shines else None


def _in_colors(strengths: Sequence[Numbers], colors: Numbers, count: int) -> Numbers:
    """The sum of lights of some strengths, each (n,) and of its colour, shape (n, 3)."""
    total = np.zeros((count, 3), colors.dtype)
    for strength, color in zip(strengths, colors, strict=True):
        total += strength[:, np.newaxis] * color
    return total


def _left_at(left: NDArray[np.float32], volume: Volume, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Trilinear between nodes (z, y, x) in the middles of the box's cells, the outermost beyond them, shape (n,)."""
    nodes = np.array(left.shape[::-1])[:, np.newaxis]
    fractions = 0.5 + (volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]) @ positions
    index = np.clip(fractions * nodes - 0.5, 0, nodes - 1)
    low = np.minimum(index.astype(np.intp), np.maximum(nodes - 2, 0))
    high = np.minimum(low + 1, nodes - 1)
    beyond = index - low
    total = np.zeros(positions.shape[1])
    for corner in np.ndindex(2, 2, 2):
        far = np.array(corner, bool)[:, np.newaxis]
        x, y, z = np.where(far, high, low)
        total += np.where(far, beyond, 1 - beyond).prod(axis=0) * left[z, y, x]
    return total


def seen_from(scene: CompleteScene) -> str:
    """Return a name of all that the light at the samples depends on; two views of one name have the same texels."""
    camera = scene.camera
    if scene.lighting is None:
        return ""
    if not depends_on_eye(scene.lighting):
        return f"{scene.lighting}"
    eye = camera.eye if camera.projection == "perspective" else tuple(camera.forward)
    return f"{scene.lighting} {camera.projection} {eye}"


def _to_eye(volume: Volume, camera: Camera, positions: NDArray[np.float64] | None) -> Numbers:
    if camera.projection == "orthographic":
        return -camera.forward[:, np.newaxis]
    assert positions is not None
    return _unit((np.array(camera.eye) - volume.centre)[:, np.newaxis] - positions)


def _to_light(light: Light, volume: Volume, to_eye: Numbers, positions: NDArray[np.float64] | None) -> Numbers:
    if light.vector is None:
        return to_eye
    if light.kind == "directional":
        return unit(light.vector)[:, np.newaxis]
    assert positions is not None
    return _unit(position_of(light, volume)[:, np.newaxis] - positions)


def _unit(vectors: Numbers) -> Numbers:
    length = np.sqrt(_dot(vectors, vectors))
    return vectors / np.where(length > 0, length, 1.0)


def _dot(a: Numbers, b: Numbers) -> Numbers:
    """Inner products, shape (n,), of the precision of the first."""
    if b.shape[1] == 1:
        return b[:, 0].astype(a.dtype, copy=False) @ a
    return np.einsum("in,in->n", a, b.astype(a.dtype, copy=False))
