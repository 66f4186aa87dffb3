"""Matter and light at the samples: what `slab` and `extinction` store where something depends on the gradient.

Each sample is classified by its value and gradient, and lit where it lies, as it is seen from the eye; what is between
is interpolated (Gouraud 1971). So texels that are lit are made anew for another eye.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.camera import Camera
from texvol.gradient import Box, gradients
from texvol.lighting import Light, Lighting, shadow_distance, unit
from texvol.scene import Scene
from texvol.transfer import Classified, TransferFunction
from texvol.volume import Volume

Numbers = NDArray[np.floating[Any]]
Arriving = NDArray[np.float32]  # at nodes (z, y, x), of each light that casts shadows: from 0 to 1


def matter_of_samples(
    scene: Scene, transfer_function: TransferFunction, camera: Camera, arriving: Arriving | None, box: Box
) -> Classified:
    """Emission, shape (nz, ny, nx, 3), and extinction of a box of samples, per world unit, lit where the scene is.

    Where the extinction is infinite the emission is the colour that shows. `arriving` is what shadows leave of each
    light, see `texvol.shadows`.
    """
    z, y, x = (range(*part.indices(count)) for part, count in zip(box, scene.volume.values.shape, strict=True))
    emission = np.zeros((len(z), len(y), len(x), 3))
    extinction = np.zeros(emission.shape[:3])

    def one_layer(layer: int) -> None:
        part = slice(z[layer], z[layer] + 1), box[1], box[2]
        places = z[layer], y, x
        _fill(scene, transfer_function, camera, arriving, part, places, emission[layer], extinction[layer])

    try:
        with ThreadPoolExecutor() as pool:
            for _ in pool.map(one_layer, range(len(z))):
                pass
    except RuntimeError:  # no further thread is to be had: this one does it
        for layer in range(len(z)):
            one_layer(layer)
    return Classified(emission, extinction)


def _fill(
    scene: Scene,
    transfer_function: TransferFunction,
    camera: Camera,
    arriving: Arriving | None,
    box: Box,
    places: tuple[int, range, range],
    emission: NDArray,
    extinction: NDArray,
) -> None:
    """Matter of one layer of samples; what shows nothing is left 0."""
    volume = scene.volume
    values = volume.values[box][0].reshape(-1)
    shows = np.flatnonzero(transfer_function.shows_between(values, values))
    if not shows.size:
        return
    slopes = gradients(volume, scene.gradient, box)[0].reshape(-1, 3)[shows]
    slopes = slopes.astype(np.float64) / volume.smallest_spacing
    magnitudes = np.sqrt(np.einsum("ij,ij->i", slopes, slopes))
    matter = transfer_function.classify(values[shows], magnitudes if transfer_function.needs_gradient else None)
    glow = matter.emission
    if scene.lighting is not None:
        z, y, x = places
        rows, columns = np.divmod(shows, len(x))
        index = np.column_stack([columns + x.start, rows + y.start, np.full(shows.size, z)])
        where = _from_centre(volume, index)
        diffuse, highlight = shade(scene.lighting, volume, camera, where, slopes, magnitudes, arriving)
        weight = np.where(np.isinf(matter.extinction), 1.0, matter.extinction)
        glow = glow * diffuse + weight[:, np.newaxis] * highlight
    emission.reshape(-1, 3)[shows] = glow
    extinction.reshape(-1)[shows] = matter.extinction


def shade(
    lighting: Lighting,
    volume: Volume,
    camera: Camera,
    places: Numbers,
    slopes: Numbers,
    magnitudes: Numbers,
    arriving: Arriving | None = None,
) -> tuple[Numbers, Numbers]:
    """D and S of `texvol.lighting`, both (n, 3), at places (n, 3) from the middle of the box, of gradients (n, 3)."""
    share = np.clip(magnitudes / lighting.fade_for(volume), 0, 1)
    believed = (share * share * (3 - 2 * share))[:, np.newaxis]
    with np.errstate(divide="ignore", invalid="ignore"):
        normals = np.where(magnitudes[:, np.newaxis] > 0, -slopes / magnitudes[:, np.newaxis], 0.0)
    to_eye = _to_eye(volume, camera, places)
    if lighting.two_sided:
        normals = np.where(_dot(normals, to_eye) < 0, -normals, normals)
    diffuse = np.full((len(places), 3), lighting.ambient)
    highlight = np.zeros((len(places), 3))
    for light in lighting.lights:
        to_light = _to_light(light, volume, to_eye, places)
        facing = _dot(normals, to_light)
        color = np.array(light.color)
        if arriving is not None and light.kind != "head":
            left = arriving[..., lighting.casting.index(light)]
            color = color * _left_at(left, volume, places + shadow_distance(volume) * to_light)[:, np.newaxis]
        diffuse += lighting.diffuse * color * (1 - believed + believed * np.maximum(facing, 0))
        if lighting.specular > 0:
            halfway = np.maximum(_dot(normals, _unit(to_light + to_eye)), 0)
            strength = lighting.specular * believed * halfway**lighting.shininess
            highlight += np.where(facing > 0, strength, 0.0) * color
    return diffuse, highlight


def _left_at(left: NDArray[np.float32], volume: Volume, places: Numbers) -> Numbers:
    """Trilinear between nodes (z, y, x) in the middles of the box's cells, the outermost beyond them, shape (n,)."""
    shares = 0.5 + places @ (volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]).T
    nodes = np.array(left.shape[::-1])
    index = np.clip(shares * nodes - 0.5, 0, nodes - 1)
    low = np.minimum(index.astype(np.intp), np.maximum(nodes - 2, 0))
    high = np.minimum(low + 1, nodes - 1)
    beyond = index - low
    total = np.zeros(len(places))
    for corner in np.ndindex(2, 2, 2):
        far = np.array(corner, bool)
        x, y, z = np.where(far, high, low).T
        total += np.where(far, beyond, 1 - beyond).prod(axis=1) * left[z, y, x]
    return total


def seen_from(scene: Scene, camera: Camera) -> str:
    """A name of all that the light at the samples depends on; two views of one name have the same texels."""
    if scene.lighting is None:
        return ""
    eye = camera.eye if camera.projection == "perspective" else tuple(camera.forward)
    return f"{scene.lighting} {camera.projection} {eye}"


def _from_centre(volume: Volume, index: NDArray) -> Numbers:
    middle = (np.array(volume.dimensions) - 1) / 2
    return (index - middle) @ volume.world_from_index.T


def _to_eye(volume: Volume, camera: Camera, places: Numbers) -> Numbers:
    if camera.projection == "orthographic":
        return -camera.forward[np.newaxis]
    return _unit(np.array(camera.eye) - volume.centre - places)


def _to_light(light: Light, volume: Volume, to_eye: Numbers, places: Numbers) -> Numbers:
    if light.vector is None:
        return to_eye
    if light.kind == "directional":
        return unit(light.vector)[np.newaxis]
    return _unit(np.array(light.vector) - volume.centre - places)


def _unit(vectors: Numbers) -> Numbers:
    length = np.sqrt(_dot(vectors, vectors))
    return vectors / np.where(length > 0, length, 1.0)


def _dot(a: Numbers, b: Numbers) -> Numbers:
    """Inner products, shape (n, 1)."""
    return np.asarray((a * b).sum(axis=-1, keepdims=True))
