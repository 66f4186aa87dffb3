"""Sphere on which lights are placed: where a light lies on it, what a drag makes of it, and the sphere in its light.

Positions are (x, y) in radii from the sphere's middle, y upwards, as the camera sees them. A light at a position in
front lies on the half of the sphere that faces the eye; one from behind lies on the other half, and is shown through
the sphere. A drag over the rim brings a light to the other half.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.lighting import Light, Lighting, unit
from texvol.scene.volume import Volume
from texvol.util.color import srgb_from_linear
from texvol.window.navigation import triple

_MATTER = 0.8  # of the sphere, straight linear colour
_FARTHEST = 1.999  # radii of a drag: at 2 the light is exactly behind


@dataclass(frozen=True)
class Spot:
    """Position of a light on the sphere."""

    x: float
    y: float
    behind: bool = False


def _frame(camera: Camera) -> NDArray[np.float64]:
    """Return the unit vectors to the right, upwards and to the eye as rows."""
    return np.stack([camera.right, camera.upward, -camera.forward])


def direction_of(light: Light, camera: Camera, volume: Volume) -> NDArray[np.float64]:
    """Return the unit vector from the middle of the box to a light."""
    if light.vector is None:
        return -camera.forward
    if light.kind == "directional":
        return unit(light.vector)
    towards = np.array(light.vector) - volume.centre
    return unit(triple(towards)) if towards.any() else -camera.forward


def spot_of(light: Light, camera: Camera, volume: Volume) -> Spot:
    """Return where a light lies."""
    x, y, z = _frame(camera) @ direction_of(light, camera, volume)
    return Spot(float(x), float(y), bool(z < 0))


def dragged(spot: Spot, x: float, y: float) -> Spot:
    """Return where a light lies that is dragged to (x, y); beyond the rim it is on the other half."""
    radius = float(np.hypot(x, y))
    if radius <= 1:
        return Spot(x, y, spot.behind)
    inside = 2 - min(radius, _FARTHEST)
    return Spot(x * inside / radius, y * inside / radius, not spot.behind)


def moved(light: Light, spot: Spot, camera: Camera, volume: Volume) -> Light:
    """Return the light at a place on the sphere; a head light becomes one from a direction."""
    depth = float(np.sqrt(max(1 - spot.x**2 - spot.y**2, 0.0)))
    towards = np.array([spot.x, spot.y, -depth if spot.behind else depth]) @ _frame(camera)
    if light.kind == "point":
        distance = max(float(np.linalg.norm(np.array(light.vector) - volume.centre)), 1e-6 * volume.radius)
        return replace(light, vector=triple(volume.centre + distance * unit(triple(towards))))
    return Light("directional", triple(towards), light.color)


def shaded(lighting: Lighting, camera: Camera, volume: Volume, size: int, around: NDArray) -> NDArray[np.uint8]:
    """Return a picture of the sphere in the light, shape (size, size, 3); `around` is its sRGB background, 0 to 1."""
    steps = (np.arange(size) + 0.5) * (2 / size) - 1
    x, y = np.meshgrid(steps, -steps)
    square = x * x + y * y
    depth = np.sqrt(np.maximum(1 - square, 0))
    normals = np.stack([x, y, depth], axis=-1) / np.sqrt(np.maximum(square, 1))[..., np.newaxis]
    diffuse, shine = np.full((size, size, 3), lighting.ambient), np.zeros((size, size, 3))
    for light in lighting.lights:
        towards = _frame(camera) @ direction_of(light, camera, volume)
        half = towards + np.array([0.0, 0.0, 1.0])
        length = float(np.linalg.norm(half))
        facing = normals @ towards
        color = np.array(light.color)
        diffuse += lighting.diffuse * np.maximum(facing, 0)[..., np.newaxis] * color
        if length > 1e-9:
            glance = np.where(facing > 0, np.maximum(normals @ (half / length), 0) ** lighting.shininess, 0)
            shine += lighting.specular * glance[..., np.newaxis] * color
    shown = srgb_from_linear(np.clip(_MATTER * diffuse + shine, 0, 1))
    covered = np.clip((1 - np.sqrt(square)) * size / 2 + 0.5, 0, 1)[..., np.newaxis]
    return np.asarray(np.rint(255 * (covered * shown + (1 - covered) * around))).astype(np.uint8)
