"""Probe of a scene: the first visible point along a pixel's ray, and the value at a point.

The ray is sampled at half the smallest spacing. At each sample the values of all volumes are classified and their
extinctions are added. The first visible point is where the ray has met half of its total opacity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane, Cutting
from texvol.scene.label_names import name_of
from texvol.scene.sampling import sampled
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.window.editing import owner_of
from texvol.window.navigation import Position, triple

_LEAST_OPACITY = 0.02  # of a ray: with less, nothing is visible
_MOST_SAMPLES = 4096  # per ray


@dataclass(frozen=True)
class Sampled:
    """Value of one volume at a point.

    Attributes
    ----------
    number : int
        Of the volume in the scene.
    value : float
        NaN outside the volume, and where the value is missing.
    label : str
        Name of the value, if the volume is of labels that have names.
    index : (x, y, z), optional
        Nearest sample; None outside.
    """

    number: int
    value: float
    label: str = ""
    index: tuple[int, int, int] | None = None


@dataclass(frozen=True)
class Found:
    """World point with the values and the extinction there.

    Attributes
    ----------
    point : array of shape (3)
        World position.
    value : float
        Value of the first volume; NaN outside it.
    extinction : float
        Extinction per world unit; NaN if the volume is not classified.
    all : tuple of Sampled
        Of all volumes, the first one included.
    """

    point: NDArray[np.float64]
    value: float
    extinction: float
    all: tuple[Sampled, ...] = ()


def first_medium(scene: Scene, position: Position) -> NDArray[np.float64] | None:
    """Return the first visible world point at a position in the picture; None if nothing is visible there."""
    assert scene.camera is not None
    start, direction = ray(scene.camera, position)
    box = scene.box
    cutting = Cutting((*_faces(box), *scene.clip), scene.crop)
    near, far = (float(end) for end in cutting.interval(box, start - box.centre, direction))
    near = max(near, 0.0)
    if not near < far:
        return None
    count = int(np.clip(np.ceil((far - near) / (scene.smallest_spacing / 2)), 2, _MOST_SAMPLES))
    depths = near + (np.arange(count) + 0.5) * (far - near) / count
    find = _first_surface if scene.mode == "isosurface" else _half_opacity
    index = find(scene, start + depths[:, np.newaxis] * direction, (far - near) / count)
    return None if index is None else np.asarray(start + depths[index] * direction)


def at_point(scene: Scene, point: NDArray[np.float64]) -> Found:
    """Return the values of all volumes at a world point, and the extinction of the first one."""
    found = tuple(_sampled(volume, number, point) for number, volume in enumerate(scene.volumes))
    value = found[0].value
    extinction = float("nan")
    if np.isfinite(value) and scene.transfer_function is not None:
        extinction = float(_extinctions(scene.transfer_function, np.array([value]))[0])
    return Found(point, value, extinction, found)


def holds(volume: Volume, point: NDArray[np.float64]) -> bool:
    """True if a world point lies in the box of a volume."""
    index = volume.index_from_world @ (point - volume.origin)
    return bool(((index >= -0.5) & (index <= np.array(volume.dimensions) - 0.5)).all())


def _sampled(volume: Volume, number: int, point: NDArray[np.float64]) -> Sampled:
    """Return what one volume has at a world point."""
    value = float(sampled(volume, point[np.newaxis])[0])
    if not holds(volume, point):
        return Sampled(number, value)
    index = volume.index_from_world @ (point - volume.origin)
    x, y, z = (int(each) for each in np.rint(np.clip(index, 0, np.array(volume.dimensions) - 1)))
    name = name_of(volume, value) if volume.labels else ""
    return Sampled(number, value, name, (x, y, z))


def ray(camera: Camera, position: Position) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the start and the unit direction of the ray through a position in the picture."""
    across = (position[0] * camera.right + position[1] * camera.upward) * camera.half_height
    if camera.projection == "orthographic":
        return np.array(camera.eye) + across, np.array(camera.forward)
    direction = camera.forward + across
    return np.array(camera.eye), direction / np.linalg.norm(direction)


def _half_opacity(scene: Scene, points: NDArray[np.float64], step: float) -> int | None:
    """Return the index of the sample at which the ray has met half of its opacity."""
    depth = np.zeros(len(points))
    for number, volume in enumerate(scene.volumes):
        values, medium = sampled(volume, points), owner_of(scene, number).transfer_function
        if medium is not None:
            depth += _extinctions(medium, values) * step
        elif scene.mode != "composite":
            depth += np.isfinite(values) * 1.0  # all samples count alike: the middle of the box
    with np.errstate(over="ignore"):
        met = -np.expm1(-np.cumsum(depth))
    if not met[-1] > _LEAST_OPACITY:
        return None
    return int(np.searchsorted(met, met[-1] / 2))


def _first_surface(scene: Scene, points: NDArray[np.float64], _: float) -> int | None:
    values = sampled(scene.volume, points)
    above = np.searchsorted(np.sort(scene.isovalues), values, side="right")
    crossings = np.flatnonzero(above[1:] != above[:-1])
    if above[0]:
        return 0
    return int(crossings[0]) + 1 if crossings.size else None


def _extinctions(medium: TransferFunction, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the extinctions of values; what depends on the gradient is classified at the largest gradient."""
    magnitudes = np.full(values.shape, np.finfo(np.float64).max ** 0.25) if medium.needs_gradient else None
    extinction = medium.classify(values, magnitudes).extinction
    return np.asarray(np.minimum(np.nan_to_num(extinction, nan=0.0, posinf=1e30), 1e30))


def _faces(box: Volume) -> list[ClipPlane]:
    """Return the faces of a box as planes that keep its inside."""
    planes = []
    for row, count in zip(box.index_from_world, box.dimensions, strict=True):
        first = float(row @ box.origin) - 0.5
        planes += [ClipPlane(triple(row), first), ClipPlane(triple(-row), -first - count)]
    return planes
