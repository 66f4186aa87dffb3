"""Camera moves, as mathematics: a View is a camera and the pivot that it turns about; every move returns another View.

Angles in radians. Places in the picture are (x, y) in half heights from its middle, y upwards, so that a picture of
aspect a goes from (-a, -1) to (a, 1). With right r, upward u, forward f of the camera, and the pivot's depth d,

    orbit    eye and target turn about the pivot: freely about u and r, or as on a turntable, about `up` and r, with
             the view kept off the poles
    pan      eye and target move across the view, so that what is at the pivot's depth follows the hand
    dolly    eye and target come nearer to what is under the cursor at the pivot's depth, by a factor of the distance;
             near the pivot by a step that does not vanish, so that one goes into the matter and through it
    roll     up turns about f
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera, Projection, Vector
from texvol.scene.volume import Volume

Position = tuple[float, float]
# Views as one names them: where the camera stands seen from the middle, and what is up.
AXES: dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "+x": ((1, 0, 0), (0, 0, 1)),
    "-x": ((-1, 0, 0), (0, 0, 1)),
    "+y": ((0, 1, 0), (0, 0, 1)),
    "-y": ((0, -1, 0), (0, 0, 1)),
    "+z": ((0, 0, 1), (0, 1, 0)),
    "-z": ((0, 0, -1), (0, 1, 0)),
}
# Between view and `up`: a thousandth of what a hand aims at, a thousand times what a Camera takes for parallel.
_POLE = np.radians(0.1)
LEAST_FOV, LARGEST_FOV = 1.0, 150.0  # degrees: with less or more nothing is left to recognise
# A step of the wheel never becomes shorter than it is at this distance, in radii of the box: 20 steps cross the box.
_NEAREST = 0.5
_SMALLEST_HEIGHT, _LARGEST_HEIGHT = 1e-4, 1e4  # of an orthographic picture, in radii: beyond, float32 runs out
_FARTHEST = 1e4  # radii


@dataclass(frozen=True)
class View:
    """A camera and the point of the world that it turns about."""

    camera: Camera
    pivot: tuple[float, float, float]

    @classmethod
    def of(cls, camera: Camera) -> View:
        """The view that turns about what the camera looks at."""
        return cls(camera, camera.target)

    @property
    def pivot_depth(self) -> float:
        """Of the pivot along the view; of the target where the pivot is not in front of the eye."""
        depth = float(self.camera.forward @ np.subtract(self.pivot, self.camera.eye))
        distance = _distance(self.camera)
        return depth if depth > 1e-3 * distance else distance

    @property
    def half_height(self) -> float:
        """World units from the middle of the picture to its top, at the pivot's depth."""
        depth = 1.0 if self.camera.projection == "orthographic" else self.pivot_depth
        return self.camera.half_height * depth


def orbit(view: View, right: float, up: float, *, free: bool = False) -> View:
    """Matter follows the hand: so far to the right and upwards, in radians."""
    camera = view.camera
    if free:
        turn = rotation(camera.upward, -right) @ rotation(camera.right, up)
        return _turned(view, turn, tuple(turn @ camera.upward))
    axis = np.array(camera.up) / np.linalg.norm(camera.up)
    elevation = float(np.arcsin(np.clip(-camera.forward @ axis, -1, 1)))
    most = np.pi / 2 - _POLE
    # Hand up: one sees more from below.
    wanted = float(np.clip(elevation - up, -most, most))
    turn = rotation(axis, -right) @ rotation(camera.right, -(wanted - elevation))
    return _turned(view, turn, camera.up)


def roll(view: View, angle: float) -> View:
    """The picture turned counterclockwise."""
    turn = rotation(view.camera.forward, angle)
    return replace(view, camera=replace(view.camera, up=_triple(turn @ view.camera.upward)))


def pan(view: View, right: float, up: float) -> View:
    """Matter at the pivot's depth follows the hand: so many half heights to the right and upwards."""
    shift = -(right * view.camera.right + up * view.camera.upward) * view.half_height
    return replace(view, camera=_shifted(view.camera, shift))


def dolly(view: View, factor: float, at: Position, volume: Volume) -> View:
    """Distances, or an orthographic picture's height, times `factor`; what is at `at` in the pivot's depth stays."""
    camera = view.camera
    point = np.array(camera.eye) + view.pivot_depth * camera.forward + _across(view, at)
    if camera.projection == "orthographic":
        limits = np.array((_SMALLEST_HEIGHT, _LARGEST_HEIGHT)) * volume.radius
        height = float(np.clip(camera.height * factor, *limits))
        shift = _across(view, at) * (1 - height / camera.height)
        return replace(view, camera=replace(_shifted(camera, shift), height=height))
    away = point - camera.eye
    distance = float(np.linalg.norm(away))
    step = (1 - factor) * max(distance, _NEAREST * volume.radius)
    shift = away / distance * step
    if factor > 1 and np.linalg.norm(camera.eye + shift - volume.centre) > _FARTHEST * volume.radius:
        return view
    moved = _shifted(camera, shift)
    return View(moved, _kept_in_front(view.pivot, moved, volume))


def advance(view: View, step: float, volume: Volume) -> View:
    """Forward through the matter, by a share of the box's radius; an orthographic eye's plane cuts."""
    moved = _shifted(view.camera, step * volume.radius * view.camera.forward)
    if np.linalg.norm(np.subtract(moved.eye, volume.centre)) > _FARTHEST * volume.radius:
        return view
    return View(moved, _kept_in_front(view.pivot, moved, volume))


def with_fov(view: View, fov: float) -> View:
    """Another angle of view, the eye so far away that what is at the pivot's depth keeps its size."""
    camera = view.camera
    fov = float(np.clip(fov, LEAST_FOV, LARGEST_FOV))
    wider = replace(camera, fov=fov)
    if camera.projection == "orthographic":
        return replace(view, camera=wider)
    depth = view.pivot_depth
    back = depth * camera.half_height / wider.half_height - depth
    eye = np.array(camera.eye) - back * camera.forward
    # The target stays ahead of the eye.
    return replace(view, camera=replace(wider, eye=_triple(eye), target=_triple(eye + (depth + back) * camera.forward)))


def with_projection(view: View, projection: Projection, volume: Volume) -> View:
    """The other projection, with the same size of what is at the pivot's depth."""
    camera = view.camera
    if projection == camera.projection:
        return view
    half_height, point = view.half_height, np.array(camera.eye) + view.pivot_depth * camera.forward
    if projection == "perspective":
        fov = float(np.clip(camera.fov, LEAST_FOV, LARGEST_FOV))
        distance = half_height / float(np.tan(np.radians(fov) / 2))
        changed = replace(camera, projection=projection, fov=fov)
    else:
        # The plane of the eye cuts parallel rays: it stands back from the whole box.
        nearest = float((volume.corners_from_centre @ camera.forward).min())
        to_box = float(camera.forward @ (volume.centre - point)) + nearest
        distance = max(view.pivot_depth, -to_box + 0.05 * volume.radius)
        changed = replace(camera, projection=projection, height=2 * half_height)
    eye = point - distance * camera.forward
    return replace(view, camera=replace(changed, eye=_triple(eye), target=_triple(point)))


def along_axis(view: View, axis: str, volume: Volume, aspect: float) -> View:
    """The whole box from where an axis points to: one of AXES."""
    towards, up = AXES[axis]
    eye = volume.centre + 2 * volume.radius * np.array(towards, np.float64)
    camera = Camera.framing(volume, view.camera.projection, up=up, fov=view.camera.fov, aspect=aspect, eye=_triple(eye))
    return framed(View.of(camera), volume, aspect)


def framed(view: View, volume: Volume, aspect: float) -> View:
    """The whole box, from the same direction."""
    camera = view.camera
    up = camera.up
    eye = volume.centre - 2 * volume.radius * camera.forward
    found = Camera.framing(volume, camera.projection, eye=_triple(eye), up=up, fov=camera.fov, aspect=aspect)
    if camera.projection == "perspective":
        found = found._at_distance(found._fitting_distance(volume, aspect))
    return View(found, _triple(volume.centre))


def reset(view: View, volume: Volume, aspect: float) -> View:
    """The view that `texvol render` chooses, in the projection at hand."""
    camera = Camera.framing(volume, view.camera.projection, fov=view.camera.fov, aspect=aspect)
    return View(camera, _triple(volume.centre))


def with_pivot(view: View, point: Any) -> View:
    """The same picture, turning about another point."""
    return replace(view, pivot=_triple(point))


def _across(view: View, at: Position) -> Vector:
    """From the middle of the picture to a place in it, at the pivot's depth."""
    camera = view.camera
    across: Vector = (at[0] * camera.right + at[1] * camera.upward) * view.half_height
    return across


def _kept_in_front(pivot: tuple[float, float, float], camera: Camera, volume: Volume) -> tuple[float, float, float]:
    """The pivot, or where one has gone past it a point ahead: else one would turn about what lies behind."""
    depth = float(camera.forward @ np.subtract(pivot, camera.eye))
    least = 0.1 * _NEAREST * volume.radius
    if depth >= least:
        return pivot
    return _triple(np.array(camera.eye) + least * camera.forward)


def _turned(view: View, turn: NDArray[np.float64], up: Any) -> View:
    camera, pivot = view.camera, np.array(view.pivot)
    eye, target = (pivot + turn @ (np.array(point) - pivot) for point in (camera.eye, camera.target))
    return replace(view, camera=replace(camera, eye=_triple(eye), target=_triple(target), up=_triple(up)))


def _shifted(camera: Camera, shift: Vector) -> Camera:
    return replace(camera, eye=_triple(camera.eye + shift), target=_triple(camera.target + shift))


def _distance(camera: Camera) -> float:
    return float(np.linalg.norm(np.subtract(camera.target, camera.eye)))


def _triple(vector: Any) -> tuple[float, float, float]:
    return cast(tuple[float, float, float], tuple(float(each) for each in vector))


def rotation(axis: Vector, angle: float) -> NDArray[np.float64]:
    """Matrix that turns counterclockwise about a unit vector, seen from its tip (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + 2 * np.sin(angle / 2) ** 2 * (cross @ cross)
