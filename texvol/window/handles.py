"""Handles by which clip planes and the crop box are dragged in the picture.

A handle is a point p of the world that moves along an axis n. Let s(p) be the position of p in the picture. A drag by d
moves the handle by δ n, where δ minimises |s(p + δ n) - s(p) - d| to first order:

    v = ∂ s(p + δ n) / ∂δ        δ = v·d / v·v

If n points nearly at the eye, v is too short, and a drag upwards moves the handle away from the eye. A clip plane has a
second handle at the tip of an arrow along its normal; dragging the tip turns the plane about the arrow's foot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.annotation.view import EDGES
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane, Cutting, Range
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.window.navigation import Position, rotation, triple

# Half heights of the picture per radius of the box: below, a short drag would move a plane out of the box.
_LEAST_SPEED = 0.2
_ARROW = 0.5  # length of a plane's arrow, in radii of the box
_BEHIND = 1e-3  # radii of the box: what lies beside its middle is not behind
_THINNEST = 1e-3  # least width of a crop box, as a fraction of the volumes' box


@dataclass(frozen=True)
class Handle:
    """Handle of a clip plane, whose number is `plane`, or of the face (axis, end) of the crop box.

    A handle with `turns` is the tip of a plane's arrow; the handle before it in a list is the arrow's foot.
    """

    point: tuple[float, float, float]
    axis: tuple[float, float, float]
    plane: int | None = None
    face: tuple[int, int] | None = None
    turns: bool = False


def bounds(volume: Volume) -> tuple[Range, Range, Range]:
    """Return the extent of a volume's box along x, y, z of the world."""
    corners = volume.centre + volume.corners_from_centre
    x, y, z = ((float(corners[:, axis].min()), float(corners[:, axis].max())) for axis in range(3))
    return x, y, z


def within(scene: Scene) -> NDArray[np.float64] | None:
    """Return the part of the crop box inside the volumes' box, shape (3, 2); None without a crop box."""
    if scene.crop is None:
        return None
    limits = np.array(bounds(scene.box))
    return np.clip(np.array(scene.crop), limits[:, :1], limits[:, 1:])


def handles_of(scene: Scene) -> list[Handle]:
    """Return all handles of a scene."""
    found = []
    crop = within(scene)
    if crop is not None:
        middle = crop.mean(axis=1)
        for axis in range(3):
            for end in (0, 1):
                point = middle.copy()
                point[axis] = crop[axis, end]
                found.append(Handle(triple(point), triple(np.eye(3)[axis]), face=(axis, end)))
    for number, (unit, distance) in enumerate(zip(*Cutting(scene.clip).half_spaces(scene.box), strict=True)):
        point = scene.box.centre + distance * unit
        found.append(Handle(triple(point), triple(unit), plane=number))
        tip = point + _ARROW * scene.box.radius * unit
        found.append(Handle(triple(tip), triple(unit), plane=number, turns=True))
    return found


def position_of(camera: Camera, point: NDArray[np.float64]) -> Position | None:
    """Return the position of a world point in the picture, in half heights from its centre; None behind the eye."""
    right, up, depth = camera.in_eye_space(np.zeros((1, 3)), np.asarray(point, np.float64))[0]
    if depth <= 0:
        return None
    scale = camera.half_height * (depth if camera.projection == "perspective" else 1.0)
    return float(right / scale), float(up / scale)


def drag_distance(handle: Handle, camera: Camera, by: Position, radius: float) -> float:
    """Return the distance in world units by which a drag moves a handle along its axis (δ above)."""
    point, axis = np.array(handle.point), np.array(handle.axis)
    step = 1e-4 * radius
    here, there = position_of(camera, point), position_of(camera, point + step * axis)
    if here is None or there is None:
        return 0.0
    speed = np.subtract(there, here) / step
    if np.linalg.norm(speed) * radius < _LEAST_SPEED:
        return by[1] * _half_height(camera, point) * (1 if points_away(handle, camera) else -1)
    return float(speed @ np.array(by) / (speed @ speed))


def points_away(handle: Handle, camera: Camera) -> bool:
    """True if the handle's axis points away from the eye."""
    return float(np.array(handle.axis) @ camera.forward) > 0


def is_behind(point: Sequence[float], camera: Camera, middle: NDArray[np.float64], radius: float) -> bool:
    """True if a point of a box lies on its far side: farther from the eye than the box's middle."""
    return float(camera.forward @ (np.array(point) - middle)) > _BEHIND * radius


def turned(scene: Scene, handle: Handle, camera: Camera, by: Position, *, away: bool) -> dict[str, Any]:
    """Return the scene's planes after a drag of an arrow's tip; `away`: the drag began with a tip behind the foot."""
    assert handle.plane is not None
    planes = list(scene.clip)
    plane, length = planes[handle.plane], _ARROW * scene.box.radius
    foot = np.array(handle.point) - length * np.array(handle.axis)
    # An arrow that points at the eye is dragged as if it were a radius seen from its end.
    right, up = (part * _half_height(camera, foot) / length * (-1 if away else 1) for part in by)
    turn = rotation(camera.upward, right) @ rotation(camera.right, -up)
    normal = turn @ np.array(plane.normal, np.float64)
    planes[handle.plane] = ClipPlane(triple(normal), float(normal @ foot))
    return {"clip": tuple(planes)}


def _half_height(camera: Camera, point: NDArray[np.float64]) -> float:
    """Return the world units from the centre of the picture to its top, at the depth of a point."""
    depth = float(camera.forward @ (point - camera.eye)) if camera.projection == "perspective" else 1.0
    return camera.half_height * max(depth, 0.0)


def moved(scene: Scene, handle: Handle, distance: float) -> dict[str, Any]:
    """Return the changed parts of the scene with a handle moved along its axis by a distance in world units."""
    if handle.plane is not None:
        planes = list(scene.clip)
        plane = planes[handle.plane]
        planes[handle.plane] = replace(plane, offset=plane.offset + distance * float(np.linalg.norm(plane.normal)))
        return {"clip": tuple(planes)}
    assert handle.face is not None and scene.crop is not None
    axis, end = handle.face
    ranges = [list(each) for each in scene.crop]
    limits = bounds(scene.box)[axis]
    least = _THINNEST * (limits[1] - limits[0])
    ends = np.clip(ranges[axis], *limits)
    lowest, highest = (limits[0], ends[1] - least) if end == 0 else (ends[0] + least, limits[1])
    ranges[axis][end] = float(np.clip(ends[end] + distance, lowest, highest))
    return {"crop": tuple((low, high) for low, high in ranges)}


def outline(scene: Scene) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return the line segments of the crop box's edges and of each clip plane's border in the volumes' box."""
    lines = []
    crop = within(scene)
    if crop is not None:
        corners = np.array([[crop[axis, (corner >> axis) & 1] for axis in range(3)] for corner in range(8)])
        lines += [(corners[edge.start], corners[edge.end]) for edge in EDGES]
    for plane in scene.clip:
        border = _border(plane, scene.box)
        lines += [*pairwise([*border, border[0]])] if len(border) > 2 else []
    return lines


def _border(plane: ClipPlane, box: Volume) -> list[NDArray[np.float64]]:
    """Return the corners of the polygon in which a plane cuts a box, in order around the polygon."""
    (unit,), (distance,) = Cutting((plane,)).half_spaces(box)
    corners = box.corners_from_centre
    height = corners @ unit - distance
    found = []
    for _, a, b in EDGES:
        if (height[a] < 0) != (height[b] < 0):
            fraction = height[a] / (height[a] - height[b])
            found.append(corners[a] + fraction * (corners[b] - corners[a]))
    if len(found) < 3:
        return []
    middle = np.mean(found, axis=0)
    first = found[0] - middle
    first /= max(float(np.linalg.norm(first)), 1e-300)
    second = np.cross(unit, first)
    angles = [np.arctan2((each - middle) @ second, (each - middle) @ first) for each in found]
    return [box.centre + found[number] for number in np.argsort(angles)]
