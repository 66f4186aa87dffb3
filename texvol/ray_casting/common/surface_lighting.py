"""Lighting of surfaces at single positions: the formulas of `texvol.scene.lighting` in numpy."""

from __future__ import annotations

import numpy as np

from texvol.ray_casting.common.rays import Numbers
from texvol.scene.camera import Camera
from texvol.scene.gradient import Estimator, gradients
from texvol.scene.lighting import DepthCue, Light, Lighting, unit
from texvol.scene.volume import Volume

_LAYERS_AT_ONCE = 32  # layers of samples along z whose gradients are in memory at a time


def gradients_at(volume: Volume, estimator: Estimator, index: Numbers) -> Numbers:
    """Return the gradients at positions `index` (n, 3), between samples; data units per smallest spacing."""
    found = np.zeros((len(index), 3))
    position = np.clip(index, 0, np.array(volume.dimensions) - 1)
    layer = position[:, 2].astype(int) // _LAYERS_AT_ONCE
    for each in np.unique(layer):
        here = layer == each
        found[here] = _interpolated(volume, estimator, position[here])
    return found


def _interpolated(volume: Volume, estimator: Estimator, position: Numbers) -> Numbers:
    """Return `gradients_at` for positions within the outermost samples, from the box of samples around them."""
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


def reflected(
    lighting: Lighting, volume: Volume, slopes: Numbers, from_centre: Numbers, to_eye: Numbers
) -> tuple[Numbers, Numbers]:
    """Return diffuse and specular factors (D, S) of positions, both (n, 3); straight colour c becomes c D + S.

    Parameters
    ----------
    slopes : array of shape (n, 3)
        Gradients at the positions, data units per smallest spacing.
    from_centre : array of shape (n, 3)
        Positions relative to the centre of the volume, world units.
    to_eye : array of shape (n, 3)
        Unit vectors from the positions to the eye.
    """
    normal, confidence = _normals(volume, slopes, lighting.fade_for(volume))
    if lighting.two_sided:
        normal = np.where(_dot(normal, to_eye) < 0, -normal, normal)
    diffuse, specular = np.full(slopes.shape, float(lighting.ambient)), np.zeros(slopes.shape)
    for light in lighting.lights:
        color = np.array(light.color) * _strength(light, volume, from_centre)
        to_light = _direction_to(light, volume, from_centre, to_eye)
        facing = _dot(normal, to_light)
        diffuse += lighting.diffuse * color * ((1 - confidence) + confidence * np.maximum(facing, 0))
        halfway = _units(to_eye + to_light)
        shine = np.maximum(_dot(normal, halfway), 0) ** lighting.shininess
        specular += lighting.specular * color * np.where(facing > 0, confidence * shine, 0.0)
    return diffuse, specular


def cued(cue: DepthCue, box: Volume, camera: Camera, color: Numbers, depth: Numbers) -> Numbers:
    """Return straight colours (n, 3) under a depth cue, at depths (n) along the view."""
    near, far = cue.range_for(box, camera)
    t = cue.strength * np.clip((depth - near) / (far - near), 0, 1)[:, np.newaxis]
    return color * (1 - t) + t * np.array(cue.color)


def _normals(volume: Volume, slopes: Numbers, fade: float) -> tuple[Numbers, Numbers]:
    """Return unit normals, towards lower values, and the gradient confidence, 0 to 1."""
    largest = np.abs(slopes).max(axis=1, keepdims=True)
    # Scaled so that squares neither overflow nor vanish.
    scaled = np.divide(slopes, largest, out=np.zeros_like(slopes), where=largest > 0)
    magnitude = np.linalg.norm(scaled, axis=1, keepdims=True)
    with np.errstate(over="ignore"):
        fraction = np.clip(largest / volume.smallest_spacing * magnitude / fade, 0, 1)
    return -_units(scaled), fraction**2 * (3 - 2 * fraction)


def _strength(light: Light, volume: Volume, from_centre: Numbers) -> Numbers | float:
    """Return the fraction of a light that its distance leaves at positions, (n, 1)."""
    if light.fall_off is None or light.vector is None:
        return 1.0
    away = np.array(light.vector) - volume.centre - from_centre
    return light.fall_off / (np.linalg.norm(away, axis=1, keepdims=True) + light.fall_off)


def _direction_to(light: Light, volume: Volume, from_centre: Numbers, to_eye: Numbers) -> Numbers:
    """Return unit vectors from positions to a light."""
    if light.vector is None:
        return to_eye
    if light.kind == "directional":
        return np.broadcast_to(unit(light.vector), from_centre.shape)
    return _units(np.array(light.vector) - volume.centre - from_centre)


def _dot(a: Numbers, b: Numbers) -> Numbers:
    return (a * b).sum(axis=1, keepdims=True)


def _units(vectors: Numbers) -> Numbers:
    """Return vectors (n, 3) at length 1; 0 stays 0."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
