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
from texvol.lighting import Light, Lighting, unit
from texvol.scene import Scene
from texvol.transfer import Classified, TransferFunction
from texvol.volume import Volume

Numbers = NDArray[np.floating[Any]]


def matter_of_samples(scene: Scene, transfer_function: TransferFunction, camera: Camera, box: Box) -> Classified:
    """Emission, shape (nz, ny, nx, 3), and extinction of a box of samples, per world unit, lit where the scene is.

    Where the extinction is infinite the emission is the colour that shows.
    """
    z, y, x = (range(*part.indices(count)) for part, count in zip(box, scene.volume.values.shape, strict=True))
    emission = np.zeros((len(z), len(y), len(x), 3))
    extinction = np.zeros(emission.shape[:3])

    def one_layer(layer: int) -> None:
        part = slice(z[layer], z[layer] + 1), box[1], box[2]
        places = z[layer], y, x
        _fill(scene, transfer_function, camera, part, places, emission[layer], extinction[layer])

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
        diffuse, highlight = shade(scene.lighting, volume, camera, _from_centre(volume, index), slopes, magnitudes)
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
        diffuse += lighting.diffuse * np.array(light.color) * (1 - believed + believed * np.maximum(facing, 0))
        if lighting.specular > 0:
            halfway = np.maximum(_dot(normals, _unit(to_light + to_eye)), 0)
            strength = lighting.specular * believed * halfway**lighting.shininess
            highlight += np.where(facing > 0, strength, 0.0) * np.array(light.color)
    return diffuse, highlight


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
