"""Grips by which measures are dragged in the picture, and the points that clicks and drags lead to.

A point that lies on something visible stays on what is visible while it is dragged; another point, which was placed in
a slice, moves parallel to the picture. The faces of a box move along their axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.measures.measure import Measure
from texvol.scene.scene import Scene
from texvol.window import probe
from texvol.window.handles import Handle, drag_distance, is_behind, position_of
from texvol.window.navigation import Position, triple

_ON_SURFACE = 3.0  # smallest spacings: farther from what is visible, a point lies elsewhere
_THINNEST = 1e-3  # least edge of a box, of the scene's radius


class Grip(NamedTuple):
    """Grip of a measure: of a point, of the face (axis, end) of a box, or of the middle of a box."""

    measure: int
    at: tuple[float, float, float]
    point: int | None = None
    face: tuple[int, int] | None = None


def grips_of(measures: Sequence[Measure], selected: int | None) -> list[Grip]:
    """Return the grips of all shown measures; a box that is not selected has one in its middle only."""
    found: list[Grip] = []
    for number, each in enumerate(measures):
        if not each.shown:
            continue
        if each.kind != "box":
            found += [Grip(number, point, point=position) for position, point in enumerate(each.points)]
            continue
        low, high = corners(each)
        middle = (low + high) / 2
        found.append(Grip(number, triple(middle)))
        for axis, end in ((axis, end) for axis in range(3) for end in (0, 1)) if number == selected else ():
            at = middle.copy()
            at[axis] = (low, high)[end][axis]
            found.append(Grip(number, triple(at), face=(axis, end)))
    return found


def corners(box: Measure) -> NDArray[np.float64]:
    """Return the lowest and the highest corner of a box, shape (2, 3)."""
    return np.sort(np.array(box.points), axis=0)


def is_hollow(each: Measure, grip: Grip, camera: Camera, selected: int | None) -> bool:
    """True if the grip is on the far side of its box, or its measure is not selected."""
    if grip.face is None or grip.measure != selected:
        return grip.measure != selected
    low, high = corners(each)
    return is_behind(grip.at, camera, (low + high) / 2, float(np.linalg.norm(high - low)) / 2)


def on_surface(scene: Scene, camera: Camera, grip: Grip) -> bool:
    """True if the grip lies on what is visible where it is seen."""
    if grip.point is None:
        return False
    position = position_of(camera, np.array(grip.at))
    found = None if position is None else probe.first_medium(scene, position)
    near = _ON_SURFACE * scene.smallest_spacing
    return found is not None and float(np.linalg.norm(found - np.array(grip.at))) <= near


def parallel(camera: Camera, point: NDArray[np.float64], position: Position) -> NDArray[np.float64]:
    """Return the world point at a position in the picture, at the depth of another point."""
    start, direction = probe.ray(camera, position)
    depth = float(camera.forward @ (point - start))
    return np.asarray(start + depth / float(camera.forward @ direction) * direction)


def dragged(each: Measure, grip: Grip, scene: Scene, camera: Camera, position: Position, *, visible: bool) -> Measure:
    """Return the measure with a grip dragged to a position in the picture; `visible` points stay on what is visible."""
    if grip.face is not None:
        return _face_moved(each, grip, scene, camera, position)
    found = probe.first_medium(scene, position) if visible else None
    here = np.array(grip.at)
    there = parallel(camera, here, position) if found is None else found
    if grip.point is not None:
        return each.moved(grip.point, there)
    moved = np.array(each.points) + (there - here)
    return each.moved(0, moved[0]).moved(1, moved[1])


def _face_moved(each: Measure, grip: Grip, scene: Scene, camera: Camera, position: Position) -> Measure:
    assert grip.face is not None
    axis, end = grip.face
    here = position_of(camera, np.array(grip.at))
    if here is None:
        return each
    handle = Handle(grip.at, triple(np.eye(3)[axis]), face=grip.face)
    by = position[0] - here[0], position[1] - here[1]
    distance = drag_distance(handle, camera, by, scene.box.radius)
    ends = corners(each)
    least = _THINNEST * scene.box.radius
    wanted = ends[end, axis] + distance
    ends[end, axis] = max(wanted, ends[0, axis] + least) if end else min(wanted, ends[1, axis] - least)
    return each.moved(0, ends[0]).moved(1, ends[1])
