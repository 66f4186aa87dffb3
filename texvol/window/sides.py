"""Views of a scene from its sides, as `--view` has them, named by the body where the file knows it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.framing import VIEWS, ViewChoice, view_of
from texvol.scene.spaces import OPPOSITE, letters_of_space
from texvol.scene.volume import Volume
from texvol.window.navigation import View, triple

_OF_BODY = {"front": "anterior", "back": "posterior", "top": "superior", "bottom": "inferior"}
_LEVEL = 0.98  # sine of the elevation up to which a camera's `up` is that of the body: a turntable stays upright


def names(volume: Volume) -> dict[str, str]:
    """Return what the sides of VIEWS are called."""
    known = letters_of_space(volume.space) is not None
    return {side: _OF_BODY.get(side, side) if known else side for side in VIEWS}


def letters(volume: Volume) -> dict[tuple[int, int], str]:
    """Return the letters of the faces of a cube, by axis of the world and direction along it, 1 or -1."""
    known = letters_of_space(volume.space)
    if known is None:
        return {(axis, sign): ("+" if sign > 0 else "−") + "XYZ"[axis] for axis in range(3) for sign in (1, -1)}
    return {(axis, sign): known[axis] if sign > 0 else OPPOSITE[known[axis]] for axis in range(3) for sign in (1, -1)}


def upright(volume: Volume) -> NDArray[np.float64]:
    """Return the unit vector that is up in the world, or to the head of the body."""
    return view_of(volume, ViewChoice("front"))[1]


def from_side(view: View, side: str, volume: Volume, aspect: float) -> View:
    """Look at the whole box from a side of VIEWS."""
    towards, up = view_of(volume, ViewChoice(side))
    vertical = upright(volume)
    if abs(float(towards @ vertical)) < _LEVEL:
        up = vertical
    eye, camera = triple(volume.centre + 2 * volume.radius * towards), view.camera
    return View.of(Camera.framing(volume, camera.projection, eye=eye, up=triple(up), fov=camera.fov, aspect=aspect))


def turned_to(view: View, towards: NDArray[np.float64], volume: Volume) -> View:
    """Turn about the pivot until the eye is in a direction, a unit vector of the world.

    From the side, up is that of the world. From above and below it is the direction, of the four along the axes, that
    is nearest to what is up now.
    """
    camera, pivot, vertical = view.camera, np.array(view.pivot), upright(volume)
    up = vertical
    if abs(float(towards @ vertical)) >= _LEVEL:
        axes = [sign * axis for axis in np.eye(3) for sign in (1.0, -1.0) if abs(float(axis @ vertical)) < 0.5]
        # What is up in a picture from the side points away from the eye in one from above.
        now = camera.upward + 1e-3 * np.sign(float(towards @ vertical)) * camera.forward
        up = max(axes, key=lambda axis: float(axis @ now))
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    before = np.stack([camera.right, camera.upward, -camera.forward], axis=1)
    after = np.stack([right, np.cross(towards, right), towards], axis=1)
    turn = after @ before.T
    eye, target = (pivot + turn @ (np.array(point) - pivot) for point in (camera.eye, camera.target))
    found = Camera(camera.projection, triple(eye), triple(target), triple(up), camera.fov, camera.height)
    return View(found, view.pivot)
