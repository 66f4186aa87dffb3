"""Handles by which clip planes and the crop box are dragged in the picture: where they are, and what a drag does.

A handle sits at a point of the world and moves along an axis n. With s(p) the place of a point p in the picture, a drag
by d moves it by δ n, where δ brings s(p + δ n) as near to s(p) + d as it goes, to first order:

    v = ∂ s(p + δ n) / ∂δ        δ = v·d / v·v

Where n points at the eye, or nearly so, v says nothing, and up is away from the eye. A clip plane has a second handle,
at the tip of an arrow along its normal: the tip follows the hand, and the plane turns about the arrow's foot.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane, Range
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.window.navigation import Position, rotation

# Half heights of the picture per radius of the box; slower, a hand's breadth would move a plane out of the box.
_LEAST_SPEED = 0.2
_ARROW = 0.5  # of the box's radius
_THINNEST = 1e-3  # of a crop box, in its room


@dataclass(frozen=True)
class Handle:
    """One handle: `plane` is the number of a clip plane, or `face` (axis, end) a face of the crop box.

    One that `turns` its plane is at the tip of the arrow whose foot is the handle before it.
    """

    point: tuple[float, float, float]
    axis: tuple[float, float, float]
    plane: int | None = None
    face: tuple[int, int] | None = None
    turns: bool = False


def bounds(volume: Volume) -> tuple[Range, Range, Range]:
    """From where to where a box reaches along x, y, z of the world."""
    corners = volume.centre + volume.corners_from_centre
    x, y, z = ((float(corners[:, axis].min()), float(corners[:, axis].max())) for axis in range(3))
    return x, y, z


def within(scene: Scene) -> NDArray[np.float64] | None:
    """The crop box where it is in the volumes' box, shape (3, 2); None where there is none."""
    if scene.crop is None:
        return None
    limits = np.array(bounds(scene.box))
    return np.clip(np.array(scene.crop), limits[:, :1], limits[:, 1:])


def handles_of(scene: Scene) -> list[Handle]:
    """All handles of a scene."""
    found = []
    crop = within(scene)
    if crop is not None:
        middle = crop.mean(axis=1)
        for axis in range(3):
            for end in (0, 1):
                point = middle.copy()
                point[axis] = crop[axis, end]
                found.append(Handle(_triple(point), _triple(np.eye(3)[axis]), face=(axis, end)))
    for number, plane in enumerate(scene.clip):
        size = float(np.linalg.norm(plane.normal))
        unit = np.array(plane.normal) / size
        point = scene.box.centre + (plane.offset / size - unit @ scene.box.centre) * unit
        found.append(Handle(_triple(point), _triple(unit), plane=number))
        tip = point + _ARROW * scene.box.radius * unit
        found.append(Handle(_triple(tip), _triple(unit), plane=number, turns=True))
    return found


def position_of(camera: Camera, point: NDArray[np.float64]) -> Position | None:
    """Where a point is in the picture, in half heights from its middle; None behind the eye."""
    right, up, depth = camera.in_eye_space(np.zeros((1, 3)), np.asarray(point, np.float64))[0]
    if depth <= 0:
        return None
    scale = camera.half_height * (depth if camera.projection == "perspective" else 1.0)
    return float(right / scale), float(up / scale)


def ray_of(handle: Handle, camera: Camera, by: Position, radius: float) -> float:
    """How far along its axis a drag moves a handle."""
    point, axis = np.array(handle.point), np.array(handle.axis)
    step = 1e-4 * radius
    here, there = position_of(camera, point), position_of(camera, point + step * axis)
    if here is None or there is None:
        return 0.0
    speed = np.subtract(there, here) / step
    if np.linalg.norm(speed) * radius < _LEAST_SPEED:
        return by[1] * _half_height(camera, point) * (1 if axis @ camera.forward > 0 else -1)
    return float(speed @ np.array(by) / (speed @ speed))


def points_away(handle: Handle, camera: Camera) -> bool:
    """Whether its axis points away from the eye."""
    return float(np.array(handle.axis) @ camera.forward) > 0


def turned(scene: Scene, handle: Handle, camera: Camera, by: Position, *, away: bool) -> dict[str, object]:
    """Parts of the scene with a plane turned by a drag at the tip of its arrow, which pointed away at first, or not."""
    assert handle.plane is not None
    planes = list(scene.clip)
    plane, length = planes[handle.plane], _ARROW * scene.box.radius
    foot = np.array(handle.point) - length * np.array(handle.axis)
    # An arrow that points at the eye is as long as a radius about which its tip goes.
    right, up = (part * _half_height(camera, foot) / length * (-1 if away else 1) for part in by)
    turn = rotation(camera.upward, right) @ rotation(camera.right, -up)
    normal = turn @ np.array(plane.normal, np.float64)
    planes[handle.plane] = ClipPlane(_triple(normal), float(normal @ foot))
    return {"clip": tuple(planes)}


def _half_height(camera: Camera, point: NDArray[np.float64]) -> float:
    """World units from the middle of the picture to its top, at the depth of a point."""
    depth = float(camera.forward @ (point - camera.eye)) if camera.projection == "perspective" else 1.0
    return camera.half_height * max(depth, 0.0)


def moved(scene: Scene, handle: Handle, direction: float) -> dict[str, object]:
    """Parts of the scene with the handle moved by so much along its axis."""
    if handle.plane is not None:
        planes = list(scene.clip)
        plane = planes[handle.plane]
        planes[handle.plane] = replace(plane, offset=plane.offset + direction * float(np.linalg.norm(plane.normal)))
        return {"clip": tuple(planes)}
    assert handle.face is not None and scene.crop is not None
    axis, end = handle.face
    ranges = [list(each) for each in scene.crop]
    limits = bounds(scene.box)[axis]
    least = _THINNEST * (limits[1] - limits[0])
    first, last = (float(each) for each in np.clip(ranges[axis], *limits))
    position = (
        np.clip(first + direction, limits[0], last - least)
        if end == 0
        else np.clip(last + direction, first + least, limits[1])
    )
    ranges[axis][end] = float(position)
    return {"crop": tuple((low, high) for low, high in ranges)}


def outline(scene: Scene) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Lines that show what is dragged: the crop box's edges, and each clip plane's border in the volumes' box."""
    lines = []
    crop = within(scene)
    if crop is not None:
        corners = np.array([[crop[axis, (corner >> axis) & 1] for axis in range(3)] for corner in range(8)])
        pairs = [(a, a | 1 << axis) for a in range(8) for axis in range(3) if not a >> axis & 1]
        lines += [(corners[a], corners[b]) for a, b in pairs]
    for plane in scene.clip:
        border = _border(plane, scene.box)
        lines += [*pairwise([*border, border[0]])] if len(border) > 2 else []
    return lines


def _border(plane: ClipPlane, box: Volume) -> list[NDArray[np.float64]]:
    """Corners of the polygon in which a plane cuts a box, in order."""
    unit = np.array(plane.normal) / np.linalg.norm(plane.normal)
    corners = box.corners_from_centre
    height = corners @ unit - (plane.offset / float(np.linalg.norm(plane.normal)) - float(unit @ box.centre))
    found = []
    for a in range(8):
        for axis in range(3):
            b = a | 1 << axis
            if b != a and (height[a] < 0) != (height[b] < 0):
                fraction = height[a] / (height[a] - height[b])
                found.append(corners[a] + fraction * (corners[b] - corners[a]))
    if len(found) < 3:
        return []
    middle = np.mean(found, axis=0)
    first = found[0] - middle
    first /= max(float(np.linalg.norm(first)), 1e-300)
    second = np.cross(unit, first)
    angles = [np.arctan2((each - middle) @ second, (each - middle) @ first) for each in found]
    return [box.centre + found[position] for position in np.argsort(angles)]


def _triple(numbers: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(each) for each in numbers)
    return x, y, z
