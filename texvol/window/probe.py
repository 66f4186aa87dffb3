"""What is where: along the ray of a place in the picture, the first visible matter, and what it is.

The ray is sampled at half the smallest spacing; at each sample the values of all volumes are classified and their
extinctions add up. *First visible* is where half of all the opacity that the ray meets has been met.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.window.navigation import Position

_LEAST_OPACITY = 0.02  # of a ray: less is not seen
_MOST_SAMPLES = 4096  # of a ray


@dataclass(frozen=True)
class Found:
    """A place in the world, and what is there.

    Attributes
    ----------
    point : array of shape (3)
    value : float
        NaN outside of the volume.
    extinction : float
        Per world unit; NaN where nothing is classified.
    """

    point: NDArray[np.float64]
    value: float
    extinction: float


def first_medium(scene: Scene, position: Position) -> NDArray[np.float64] | None:
    """World point of the first visible matter at a place in the picture; None where nothing shows."""
    assert scene.camera is not None
    start, direction = ray(scene.camera, position)
    box = scene.box
    span = _span(box, start, direction)
    if span is None:
        return None
    near, far = max(span[0], 0.0), span[1]
    # What is cut away is not met.
    to_centre = start - box.centre
    first, last = scene.cutting.interval(box, to_centre[np.newaxis], direction[np.newaxis])
    near, far = max(near, float(first[0])), min(far, float(last[0]))
    if not near < far:
        return None
    count = int(np.clip(np.ceil((far - near) / (scene.smallest_spacing / 2)), 2, _MOST_SAMPLES))
    directions = near + (np.arange(count) + 0.5) * (far - near) / count
    position_of = _first_surface if scene.mode == "isosurface" else _half_way
    index = position_of(scene, start + directions[:, np.newaxis] * direction, (far - near) / count)
    return None if index is None else np.asarray(start + directions[index] * direction)


def at_point(scene: Scene, point: NDArray[np.float64]) -> Found:
    """Value and extinction of the first volume at a place in the world."""
    value = float(sampled(scene.volume, point[np.newaxis])[0])
    extinction = float("nan")
    if np.isfinite(value) and scene.transfer_function is not None:
        extinction = float(_extinctions(scene.transfer_function, np.array([value]))[0])
    return Found(point, value, extinction)


def ray(camera: Camera, position: Position) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Start and unit direction of the ray through a place in the picture."""
    across = (position[0] * camera.right + position[1] * camera.upward) * camera.half_height
    if camera.projection == "orthographic":
        return np.array(camera.eye) + across, np.array(camera.forward)
    direction = camera.forward + across
    return np.array(camera.eye), direction / np.linalg.norm(direction)


def sampled(volume: Volume, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values at points of the world, shape (n): trilinear, of labels the nearest; NaN outside of the box."""
    counts = np.array(volume.dimensions)
    index = (points - volume.origin) @ volume.index_from_world.T
    inside = ((index >= -0.5) & (index <= counts - 0.5)).all(axis=1)
    index = np.clip(index, 0, counts - 1)
    if volume.labels:
        x, y, z = np.rint(index).astype(int).T
        return np.where(inside, volume.values[z, y, x].astype(np.float64), np.nan)
    low = np.minimum(index.astype(int), np.maximum(counts - 2, 0))
    fraction = index - low
    high = np.minimum(low + 1, counts - 1)
    result = np.zeros(len(points))
    for corner in range(8):
        bits = [(corner >> axis) & 1 for axis in range(3)]
        x, y, z = (np.where(bit, high[:, axis], low[:, axis]) for axis, bit in enumerate(bits))
        weight = np.prod([fraction[:, axis] if bit else 1 - fraction[:, axis] for axis, bit in enumerate(bits)], axis=0)
        with np.errstate(invalid="ignore"):
            result += np.where(weight > 0, weight * volume.values[z, y, x].astype(np.float64), 0.0)
    return np.where(inside, result, np.nan)


def _half_way(scene: Scene, points: NDArray[np.float64], step: float) -> int | None:
    """Number of the sample at which half of the ray's opacity has been met."""
    depth = np.zeros(len(points))
    media = [(scene.volume, scene.transfer_function)]
    media += [(each.volume, each.transfer_function) for each in scene.added]
    for volume, medium in media:
        if medium is not None:
            depth += _extinctions(medium, sampled(volume, points)) * step
        elif scene.mode != "composite":
            depth += np.isfinite(sampled(volume, points)) * 1.0  # everything counts alike: the middle of the box
    with np.errstate(over="ignore"):
        met = -np.expm1(-np.cumsum(depth))
    if not met[-1] > _LEAST_OPACITY:
        return None
    return int(np.searchsorted(met, met[-1] / 2))


def _first_surface(scene: Scene, points: NDArray[np.float64], _: float) -> int | None:
    assert scene.isovalue is not None
    above = sampled(scene.volume, points) >= scene.isovalue
    crossings = np.flatnonzero(above[1:] != above[:-1])
    if above[0]:
        return 0
    return int(crossings[0]) + 1 if crossings.size else None


def _extinctions(medium: TransferFunction, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of values, where the gradient has no say: matter at its largest gradient hides nothing that shows."""
    magnitudes = np.full(values.shape, np.finfo(np.float64).max ** 0.25) if medium.needs_gradient else None
    extinction = medium.classify(values, magnitudes).extinction
    return np.asarray(np.minimum(np.nan_to_num(extinction, nan=0.0, posinf=1e30), 1e30))


def _span(volume: Volume, start: NDArray[np.float64], direction: NDArray[np.float64]) -> tuple[float, float] | None:
    """From where to where a ray is in the box, in world units from its start."""
    counts = np.array(volume.dimensions)
    position = (start - volume.origin) @ volume.index_from_world.T
    velocity = volume.index_from_world @ direction
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (-0.5 - position) / velocity, (counts - 0.5 - position) / velocity
    within = (position >= -0.5) & (position <= counts - 0.5)
    low = np.where(velocity == 0, np.where(within, -np.inf, np.inf), np.minimum(one, other))
    high = np.where(velocity == 0, np.where(within, np.inf, -np.inf), np.maximum(one, other))
    near, far = float(low.max()), float(high.min())
    return (near, far) if near < far and far > 0 else None
