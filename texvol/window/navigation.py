"""Camera moves as mathematics: a View is a camera and the pivot that it turns about; each move returns a new View.

Angles are in radians. Positions in the picture are (x, y) in half heights from its centre, y upwards: a picture of
aspect a reaches from (-a, -1) to (a, 1). With right r, upward u and forward f of the camera, and the pivot's depth d:

    orbit    eye and target turn about the pivot: freely about u and r, or on a turntable about `up` and r, where the
             view is kept away from the poles
    pan      eye and target move across the view, so that points at depth d follow the mouse
    dolly    eye and target approach the point under the cursor at depth d; the distance changes by a factor. Near the
             pivot the step has a least length, so that the eye can enter the medium and pass through it
    roll     up turns about f
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera, Projection, Vector
from texvol.scene.framing import filled
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

Position = tuple[float, float]
# Directions from the box's centre to the eye, and the up vectors, of the named views.
AXES: dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "+x": ((1, 0, 0), (0, 0, 1)),
    "-x": ((-1, 0, 0), (0, 0, 1)),
    "+y": ((0, 1, 0), (0, 0, 1)),
    "-y": ((0, -1, 0), (0, 0, 1)),
    "+z": ((0, 0, 1), (0, 1, 0)),
    "-z": ((0, 0, -1), (0, 1, 0)),
}
# Least angle between view and `up`: 1000 times the angle at which a Camera takes them for parallel.
_POLE = np.radians(0.1)
LEAST_FOV, LARGEST_FOV = 1.0, 150.0  # degrees: beyond, a picture can't be recognised
# The least distance, in radii of the box, that a step of the wheel is taken from: 20 steps cross the box.
_NEAREST = 0.5
_SMALLEST_HEIGHT, _LARGEST_HEIGHT = 1e-4, 1e4  # of an orthographic picture, in radii: beyond, float32 is too coarse
_FARTHEST = 1e4  # largest distance from the box's centre, in radii


@dataclass(frozen=True)
class View:
    """Camera, and the world point that it turns about."""

    camera: Camera
    pivot: tuple[float, float, float]

    @classmethod
    def of(cls, camera: Camera) -> View:
        """Return the view that turns about the camera's target."""
        return cls(camera, camera.target)

    @property
    def pivot_depth(self) -> float:
        """Depth of the pivot along the view; the target's depth if the pivot is not in front of the eye."""
        depth = float(self.camera.forward @ np.subtract(self.pivot, self.camera.eye))
        distance = float(np.linalg.norm(np.subtract(self.camera.target, self.camera.eye)))
        return depth if depth > 1e-3 * distance else distance

    @property
    def half_height(self) -> float:
        """World units from the centre of the picture to its top, at the pivot's depth."""
        depth = 1.0 if self.camera.projection == "orthographic" else self.pivot_depth
        return self.camera.half_height * depth


def orbit(view: View, right: float, up: float, *, free: bool = False) -> View:
    """Turn the scene to the right and upwards, by angles in radians."""
    camera = view.camera
    if free:
        turn = rotation(camera.upward, -right) @ rotation(camera.right, up)
        return _turned(view, turn, tuple(turn @ camera.upward))
    axis = np.array(camera.up) / np.linalg.norm(camera.up)
    elevation = float(np.arcsin(np.clip(-camera.forward @ axis, -1, 1)))
    most = np.pi / 2 - _POLE
    # Dragging upwards shows more of the box from below.
    wanted = float(np.clip(elevation - up, -most, most))
    turn = rotation(axis, -right) @ rotation(camera.right, -(wanted - elevation))
    return _turned(view, turn, camera.up)


def roll(view: View, angle: float) -> View:
    """Turn the picture counterclockwise."""
    turn = rotation(view.camera.forward, angle)
    return replace(view, camera=replace(view.camera, up=triple(turn @ view.camera.upward)))


def pan(view: View, right: float, up: float) -> View:
    """Move the scene to the right and upwards, in half heights at the pivot's depth."""
    shift = -(right * view.camera.right + up * view.camera.upward) * view.half_height
    return replace(view, camera=_shifted(view.camera, shift))


def dolly(view: View, factor: float, at: Position, volume: Volume) -> View:
    """Multiply the distance, or an orthographic picture's height, by `factor`; the point at `at` stays in place."""
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
    return _moved(view, shift, volume)


def advance(view: View, step: float, volume: Volume) -> View:
    """Move the eye forward by `step` radii of the box; the plane of an orthographic eye cuts the medium."""
    moved = _moved(view, step * volume.radius * view.camera.forward, volume)
    is_too_far = np.linalg.norm(np.subtract(moved.camera.eye, volume.centre)) > _FARTHEST * volume.radius
    return view if is_too_far else moved


def with_fov(view: View, fov: float) -> View:
    """Change the vertical angle of view, in degrees; points at the pivot's depth keep their size."""
    camera = view.camera
    fov = float(np.clip(fov, LEAST_FOV, LARGEST_FOV))
    wider = replace(camera, fov=fov)
    if camera.projection == "orthographic":
        return replace(view, camera=wider)
    depth = view.pivot_depth
    back = depth * camera.half_height / wider.half_height - depth
    eye = np.array(camera.eye) - back * camera.forward
    # The target stays in front of the eye.
    return replace(view, camera=replace(wider, eye=triple(eye), target=triple(eye + (depth + back) * camera.forward)))


def with_projection(view: View, projection: Projection, volume: Volume) -> View:
    """Change the projection; points at the pivot's depth keep their size."""
    camera = view.camera
    if projection == camera.projection:
        return view
    half_height, point = view.half_height, np.array(camera.eye) + view.pivot_depth * camera.forward
    if projection == "perspective":
        fov = float(np.clip(camera.fov, LEAST_FOV, LARGEST_FOV))
        distance = half_height / float(np.tan(np.radians(fov) / 2))
        changed = replace(camera, projection=projection, fov=fov)
    else:
        # An orthographic eye shows nothing behind its plane, so the plane is placed before the whole box.
        nearest = float((volume.corners_from_centre @ camera.forward).min())
        to_box = float(camera.forward @ (volume.centre - point)) + nearest
        distance = max(view.pivot_depth, -to_box + 0.05 * volume.radius)
        changed = replace(camera, projection=projection, height=2 * half_height)
    eye = point - distance * camera.forward
    return replace(view, camera=replace(changed, eye=triple(eye), target=triple(point)))


def along_axis(view: View, axis: str, volume: Volume, aspect: float) -> View:
    """Look at the whole box along an axis: one of AXES."""
    towards, up = AXES[axis]
    eye = volume.centre + 2 * volume.radius * np.array(towards, np.float64)
    camera = Camera.framing(volume, view.camera.projection, up=up, fov=view.camera.fov, aspect=aspect, eye=triple(eye))
    return framed(View.of(camera), volume, aspect)


def framed(view: View, volume: Volume, aspect: float) -> View:
    """Look at the whole box from the current direction."""
    camera = view.camera
    up = camera.up
    eye = volume.centre - 2 * volume.radius * camera.forward
    found = Camera.framing(volume, camera.projection, eye=triple(eye), up=up, fov=camera.fov, aspect=aspect)
    if camera.projection == "perspective":
        found = found.at_distance(found.fitting_distance(volume, aspect))
    return View(found, triple(volume.centre))


def reset(view: View, volume: Volume, aspect: float) -> View:
    """Return the default view of `texvol render`, in the current projection."""
    camera = Camera.framing(volume, view.camera.projection, fov=view.camera.fov, aspect=aspect)
    return View(camera, triple(volume.centre))


def has_time(scene: Scene) -> bool:
    """True if a volume of the scene is a step of a time series."""
    return any(volume.source.get("time") is not None for volume in scene.volumes)


def on_content(view: View, scene: Scene, aspect: float) -> View:
    """Look at what shows of a scene from the current direction; at the whole box of a series, where things move."""
    if has_time(scene):
        return framed(view, scene.box, aspect)
    camera = filled(view.camera, scene.looked, aspect)
    return View(camera, camera.target)


def with_pivot(view: View, point: Any) -> View:
    """Return the same picture with another pivot."""
    return replace(view, pivot=triple(point))


def _across(view: View, at: Position) -> Vector:
    """Return the world vector from the centre of the picture to a position in it, at the pivot's depth."""
    camera = view.camera
    across: Vector = (at[0] * camera.right + at[1] * camera.upward) * view.half_height
    return across


def _moved(view: View, shift: Vector, volume: Volume) -> View:
    """Return the view with a shifted camera; if the eye has passed the pivot, the pivot is put in front of the eye."""
    camera = _shifted(view.camera, shift)
    least = 0.1 * _NEAREST * volume.radius
    if float(camera.forward @ np.subtract(view.pivot, camera.eye)) >= least:
        return View(camera, view.pivot)
    return View(camera, triple(np.array(camera.eye) + least * camera.forward))


def _turned(view: View, turn: NDArray[np.float64], up: Any) -> View:
    camera, pivot = view.camera, np.array(view.pivot)
    eye, target = (pivot + turn @ (np.array(point) - pivot) for point in (camera.eye, camera.target))
    return replace(view, camera=replace(camera, eye=triple(eye), target=triple(target), up=triple(up)))


def _shifted(camera: Camera, shift: Vector) -> Camera:
    return replace(camera, eye=triple(camera.eye + shift), target=triple(camera.target + shift))


def triple(vector: Any) -> tuple[float, float, float]:
    """Return three numbers as a tuple of floats."""
    return cast(tuple[float, float, float], tuple(float(each) for each in vector))


def rotation(axis: Vector, angle: float) -> NDArray[np.float64]:
    """Return the matrix of a counterclockwise rotation about a unit vector, seen from its tip (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + 2 * np.sin(angle / 2) ** 2 * (cross @ cross)
