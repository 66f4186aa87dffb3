"""Fields that are lit, or graded, by the renderer: linear ones with closed forms, smooth ones for the oracle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import DTypeLike, NDArray

from support.scenes import path_lengths
from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera, Projection
from texvol.scene.lighting import Light, Lighting
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

SIZE = (24, 24)
ULP = 2.0**-24
KINDS = ("slab", "extinction", "post", "integrated")
# As in test_closed_forms_drawn: blends, registers, texels and series, relative to the brightest of the picture.
ROUNDING = 20 * ULP
SHEARED = np.array([[-1, 0.2, 0], [0.1, 1, 0.3], [0, -0.2, 1]])
SPACING = np.array([1, 0.8, 1.3])
SLOPE = np.array([0.3, -0.5, 0.2])  # of a linear field, data units per world unit
FOG = TransferFunction(
    np.array([0, 0.3, 0.6, 1]),
    np.array([(0.2, 0.3, 0.9), (0.4, 0.8, 0.5), (0.9, 0.6, 0.2), (1, 1, 0.9)]),
    np.array([0, 0.02, 0.06, 0.15]),
)
# A warm light from the left, above; a cold one inside the box of `smooth`; from the eye; and all of them.
SUN = Light("directional", (1, -2, 0.5), (1.0, 0.8, 0.6))
LAMP = Light("point", (1.0, 9.0, 11.0), (0.3, 0.8, 0.6))
LIGHTS = {
    "head": Lighting(),
    "sun": Lighting((SUN,)),
    "sun, one side": Lighting((SUN,), two_sided=False),
    "all, one side": Lighting((LAMP, Light(), SUN), shininess=8.0, two_sided=False),
}


def grid(dimensions: Sequence[int], world: float = 1.0, **further: object) -> Volume:
    """Zeros on a sheared, left-handed, anisotropic grid whose lengths are `world` times as long."""
    shape = tuple(dimensions)[::-1]
    return Volume(np.zeros(shape, np.float32), world * SPACING, world * np.array([-3, 5, 7]), SHEARED, **further)


def with_values(volume: Volume, values: NDArray) -> Volume:
    return Volume(values, volume.spacing, volume.origin, volume.direction)


def linear(slope: NDArray[np.float64] = SLOPE, dtype: DTypeLike = np.float32, world: float = 1.0) -> Volume:
    """Value slope · (place - origin) / world."""
    volume = grid((13, 9, 7), world)
    z, y, x = np.meshgrid(*(np.arange(count) for count in volume.values.shape), indexing="ij")
    values = np.stack([x, y, z], axis=-1) @ (volume.world_from_index / world).T @ slope
    return with_values(volume, values.astype(dtype))


def smooth(dtype: DTypeLike = np.float32, low: float = 0.0, high: float = 1.0, world: float = 1.0) -> Volume:
    """A few waves from `low` to `high`."""
    volume = grid((18, 14, 17), world)
    z, y, x = np.meshgrid(*[(np.arange(n) + 0.5) / n * 2 - 1 for n in volume.values.shape], indexing="ij")
    waves = 0.5 + 0.5 * np.sin(3 * x + y) * np.cos(2 * y - z) * np.sin(3 * z + 1)
    values = low + (high - low) * waves
    return with_values(volume, np.rint(values).astype(dtype) if np.dtype(dtype).kind in "iu" else values.astype(dtype))


def framed(volume: Volume, projection: Projection = "orthographic") -> Camera:
    return Camera.framing(volume, projection, fov=55 if projection == "perspective" else None)


def even(extinction: float = 0.15, color: Sequence[float] = (0.9, 0.6, 0.3)) -> TransferFunction:
    """The same matter whatever the value."""
    return TransferFunction(np.zeros(1), np.array([color]), np.array([extinction]))


def scaled(medium: TransferFunction, low: float, high: float, world: float = 1.0) -> TransferFunction:
    """Matter for values of 0 to 1 as it is for `low` to `high`, in a world `world` times as large."""
    return TransferFunction(low + (high - low) * medium.values, medium.colors, medium.extinctions / world)


def shade(lighting: Lighting, slope: NDArray, to_eye: NDArray, fade: float) -> tuple[NDArray, NDArray]:
    """D and S of `texvol.scene.lighting`, each (h, w, 3), where the gradient is `slope` all over; no point lights."""
    magnitude = np.linalg.norm(slope)
    normal = np.broadcast_to(-slope / magnitude, to_eye.shape)
    if lighting.two_sided:
        normal = np.where(dot(normal, to_eye) < 0, -normal, normal)
    fraction = min(magnitude / fade, 1.0)
    confidence = fraction**2 * (3 - 2 * fraction)
    diffuse, highlight = np.full(to_eye.shape, lighting.ambient), np.zeros(to_eye.shape)
    for light in lighting.lights:
        to_light = to_eye if light.vector is None else unit(np.array(light.vector))
        facing = dot(normal, to_light)
        diffuse = diffuse + lighting.diffuse * np.array(light.color) * (
            1 - confidence + confidence * np.maximum(facing, 0)
        )
        shine = np.maximum(dot(normal, unit(to_light + to_eye)), 0) ** lighting.shininess
        highlight = highlight + np.where(facing > 0, lighting.specular * confidence * shine, 0) * np.array(light.color)
    return diffuse, highlight


def lit_and_even(scene: Scene, slope: NDArray, size: tuple[int, int] = SIZE) -> NDArray[np.float64]:
    """The picture of even matter in a linear field: (c D + S)(1 - e^-τL)."""
    camera, medium, lighting = scene.camera, scene.transfer_function, scene.lighting
    assert camera is not None and medium is not None and lighting is not None
    _, directions = camera.rays(size)
    diffuse, highlight = shade(lighting, slope, -directions, lighting.fade_for(scene.volume))
    opacity = -np.expm1(-medium.extinctions[0] * path_lengths(scene.volume, camera, size))[..., np.newaxis]
    return np.concatenate([(medium.colors[0] * diffuse + highlight) * opacity, opacity], axis=-1)


def tolerance(lighting: Lighting, direction_error: float = 4 * ULP) -> float:
    """Rounding, and what an error of the normal's direction does: as much to N·L, n times as much to (N·H)^n."""
    brightest = max(lighting.brightest, 1.0)
    light = sum(max(each.color) for each in lighting.lights)
    return ROUNDING * brightest + direction_error * light * (lighting.diffuse + lighting.specular * lighting.shininess)


def drawn(renderer: Renderer, scene: Scene, rate: float = 1, size: tuple[int, int] = SIZE) -> NDArray[np.float64]:
    """Without rounded texels."""
    return renderer.render(scene, size, sampling_rate=rate, texture_format="rgba32f").astype(np.float64)


def largest(difference: NDArray) -> float:
    return float(np.abs(difference).max())


def errors(renderer: Renderer, scene: Scene, rates: Sequence[float]) -> list[float]:
    """Rms errors against the oracle."""
    truth = raycast(scene, SIZE)
    return [float(np.sqrt(np.square(drawn(renderer, scene, rate) - truth).mean())) for rate in rates]


def order(renderer: Renderer, scene: Scene, rates: tuple[float, float] = (1, 8)) -> float:
    """Of convergence to the oracle."""
    coarse, fine = errors(renderer, scene, rates)
    return float(np.log(coarse / fine) / np.log(rates[1] / rates[0]))


def dot(a: NDArray, b: NDArray) -> NDArray:
    return (a * b).sum(axis=-1, keepdims=True)


def unit(vector: NDArray) -> NDArray:
    """At length 1; 0 stays 0."""
    length = np.sqrt(dot(vector, vector))
    return vector / np.where(length > 0, length, 1.0)
