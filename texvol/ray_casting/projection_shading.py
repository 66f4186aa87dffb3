"""How a surface of one value is lit, place by place: the formulas of `texvol.scene.lighting`, written out in numpy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.gradient import Estimator, gradients
from texvol.scene.lighting import Light, Lighting, unit
from texvol.scene.volume import Volume

Array = NDArray[np.float64]
_LAYERS_AT_ONCE = 32  # of samples along z, whose gradients are held at one time


def gradients_at(volume: Volume, estimator: Estimator, index: Array) -> Array:
    """Gradients at places (n, 3) in index space, interpolated between samples; data units per smallest spacing."""
    found = np.zeros((len(index), 3))
    position = np.clip(index, 0, np.array(volume.dimensions) - 1)
    layer = position[:, 2].astype(int) // _LAYERS_AT_ONCE
    for each in np.unique(layer):
        here = layer == each
        found[here] = _interpolated(volume, estimator, position[here])
    return found


def _interpolated(volume: Volume, estimator: Estimator, position: Array) -> Array:
    """`gradients_at` of places within the outermost samples, from the box of samples around them."""
    near = np.floor(position).astype(int)
    far = np.minimum(near + 1, np.array(volume.dimensions) - 1)
    first, end = near.min(axis=0), far.max(axis=0) + 1
    box = (slice(first[2], end[2]), slice(first[1], end[1]), slice(first[0], end[0]))
    samples = gradients(volume, estimator, box)
    fraction, total = position - near, np.zeros(position.shape)
    for corner in range(8):
        bits = (corner >> np.arange(3)) & 1
        x, y, z = (np.where(bits, far, near) - first).T
        weight = np.where(bits, fraction, 1 - fraction).prod(axis=1, keepdims=True)
        total += weight * samples[z, y, x]
    return total


def answer(lighting: Lighting, volume: Volume, slopes: Array, from_centre: Array, to_eye: Array) -> tuple[Array, Array]:
    """What matter sends of the light that falls on it, (D, S), both (n, 3); straight colour c becomes c D + S.

    Parameters
    ----------
    slopes : array of shape (n, 3)
        Gradients there, data units per smallest spacing.
    from_centre : array of shape (n, 3)
        The places, relative to the centre of the volume.
    to_eye : array of shape (n, 3)
        Unit vectors.
    """
    normal, meaning = _normals(volume, slopes, lighting.fade_for(volume))
    if lighting.two_sided:
        normal = np.where(_dot(normal, to_eye) < 0, -normal, normal)
    diffuse, specular = np.full(slopes.shape, float(lighting.ambient)), np.zeros(slopes.shape)
    for light in lighting.lights:
        color = np.array(light.color)
        to_light = _direction_to(light, volume, from_centre, to_eye)
        facing = _dot(normal, to_light)
        diffuse += lighting.diffuse * color * ((1 - meaning) + meaning * np.maximum(facing, 0))
        halfway = _units(to_eye + to_light)
        shine = np.maximum(_dot(normal, halfway), 0) ** lighting.shininess
        specular += lighting.specular * color * np.where(facing > 0, meaning * shine, 0.0)
    return diffuse, specular


def _normals(volume: Volume, slopes: Array, fade: float) -> tuple[Array, Array]:
    """Unit normals, towards lower values, and how much they mean, from 0 to 1."""
    largest = np.abs(slopes).max(axis=1, keepdims=True)
    scaled = np.divide(slopes, largest, out=np.zeros_like(slopes), where=largest > 0)  # its square is a number
    magnitude = np.linalg.norm(scaled, axis=1, keepdims=True)
    with np.errstate(over="ignore"):
        fraction = np.clip(largest / volume.smallest_spacing * magnitude / fade, 0, 1)
    return -_units(scaled), fraction**2 * (3 - 2 * fraction)


def _direction_to(light: Light, volume: Volume, from_centre: Array, to_eye: Array) -> Array:
    """Unit vectors from places to a light."""
    if light.vector is None:
        return to_eye
    if light.kind == "directional":
        return np.broadcast_to(unit(light.vector), from_centre.shape)
    return _units(np.array(light.vector) - volume.centre - from_centre)


def _dot(a: Array, b: Array) -> Array:
    return (a * b).sum(axis=1, keepdims=True)


def _units(vectors: Array) -> Array:
    """`vectors` at length 1, or 0 where they are."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
