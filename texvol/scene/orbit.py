"""Cameras that turn around a scene.

The axis goes through the target along `up`. With k the unit vector of the axis and p the part of eye - target across
it, the eye that is turned by an angle θ, counterclockwise as seen from the tip of `up`, is

    eye(θ) = eye + (cos θ - 1) p + sin θ k × p        (Rodrigues, less eye(0) = eye)

Height above the target, distance and `up` stay, so that every view is a rotation of the first. About another axis
through the target, `up` is turned as the eye is.

An orbit of several rows is a grid of views: all columns at one elevation above the plane across the axis, then all at
the next lower one. Its cameras have the axis as their `up`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.camera import FRAMING_MARGIN, Camera, Projection
from texvol.scene.spaces import OPPOSITE, letters_of_space
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.suggestions import check_one_of

AXES = ("up", "picture", "head", "x", "y", "z")
HIGHEST = 80.0  # degrees, elevation of the first of several rows; at 90 there is no direction upwards
_ANGLES = 360  # at which an orbit about another axis than `up` is looked at to frame it
_COLUMNS = 36  # the same of each row of several


@dataclass(frozen=True)
class Turn:
    """Axis of an orbit, and how far and in which direction the camera turns.

    Parameters
    ----------
    axis : str
        "up": the camera's `up`. "picture": what points up in the first picture. "head": to the head of the body.
        "x", "y", "z": axes of the world.
    turns : float
        Number of turns, counterclockwise as seen from the tip of the axis; clockwise if negative.
    rows : int
        Number of elevations, at equal angles from 80 to -80 degrees. A single row has the camera's own elevation.
    """

    axis: str = "up"
    turns: float = 1.0
    rows: int = 1

    def __post_init__(self) -> None:
        check_one_of("orbit: axis", self.axis, AXES)
        number = isinstance(self.turns, int | float) and not isinstance(self.turns, bool)
        if not number or not 0 < abs(self.turns) <= 1000:
            raise InputError(f"orbit: turns must be a number other than 0, from -1000 to 1000, got {self.turns!r}")
        if self.rows > 1 and self.turns != 1:
            raise InputError(f"orbit: several rows need one turn, got {self.turns:g} turns")

    def direction(self, camera: Camera, volume: Volume) -> NDArray[np.float64] | None:
        """Return the unit vector of the axis, shape (3); None if it is the camera's `up`.

        Raises
        ------
        InputError
            If the volume does not say where the head of the body is.
        """
        if self.axis == "up":
            return None
        if self.axis == "picture":
            return camera.upward
        if self.axis != "head":
            return np.eye(3)["xyz".index(self.axis)]
        letters = letters_of_space(volume.space)
        if letters is None:
            raise InputError("orbit: axis head needs a file that says where the head is: choose up, picture, x, y or z")
        return np.array([float(each == "S") - float(each == OPPOSITE["S"]) for each in letters])


def cameras(first: Camera, count: int, turn: Turn, volume: Volume) -> Iterator[Camera]:
    """Yield the cameras of `count` views, row by row; in a single row the first one is `first`."""
    about = turn.direction(first, volume)
    if turn.rows == 1:
        yield from (turned(first, turn.turns * (360 * number / count), about) for number in range(count))
        return
    columns = count // turn.rows
    for elevation in elevations(turn.rows):
        begin = raised(first, elevation, _axis(first) if about is None else about)
        yield from (turned(begin, 360 * number / columns) for number in range(columns))


def elevations(rows: int) -> list[float]:
    """Return the elevations of several rows, in degrees."""
    return [float(each) for each in np.linspace(HIGHEST, -HIGHEST, rows)]


def elevation_of(camera: Camera, axis: NDArray[np.float64]) -> float:
    """Return the elevation of the eye above the plane through the target across the axis, in degrees."""
    return float(np.degrees(np.arcsin(np.clip(-np.asarray(camera.forward) @ axis, -1, 1))))


def raised(camera: Camera, degrees: float, axis: NDArray[np.float64]) -> Camera:
    """Return the camera at an elevation on its own side of an axis, a unit vector that becomes its `up`."""
    to_eye = np.subtract(camera.eye, camera.target)
    level = to_eye - (to_eye @ axis) * axis
    if np.linalg.norm(level) < 1e-6 * np.linalg.norm(to_eye):  # the eye is on the axis
        level = -np.sign(to_eye @ axis) * np.asarray(camera.upward)
        level = level - (level @ axis) * axis
    level = level / np.linalg.norm(level)
    angle = np.radians(degrees)
    offset = np.linalg.norm(to_eye) * (np.cos(angle) * level + np.sin(angle) * axis)
    return replace(camera, eye=tuple(np.array(camera.target) + offset), up=tuple(axis))


def turned(camera: Camera, degrees: float, about: NDArray[np.float64] | None = None) -> Camera:
    """The camera, turned about an axis through its target, by default along its `up`; in float64.

    Turned by 0 it is the same camera to the last bit: what is added to the eye is 0 then, wherever the world's origin
    is. 1 - cos θ is written 2 sin² θ/2, which keeps its digits for small steps. `about` is a unit vector, shape (3).
    """
    angle = np.radians(degrees)
    axis = _axis(camera) if about is None else about
    vectors = np.array([np.subtract(camera.eye, camera.target), camera.up])
    across = vectors - np.outer(vectors @ axis, axis)
    offset, up = np.sin(angle) * np.cross(axis, across) - 2 * np.sin(angle / 2) ** 2 * across
    eye = tuple(np.array(camera.eye) + offset)
    return replace(camera, eye=eye, up=camera.up if about is None else tuple(np.array(camera.up) + up))


def framing(
    volume: Volume,
    projection: Projection = "orthographic",
    *,
    eye: Sequence[float] | None = None,
    towards: ArrayLike | None = None,
    height: float | None = None,
    aspect: float = 1.0,
    turn: Turn | None = None,
    **others: Any,
) -> Camera:
    """First camera of a turn in which the whole box stays in the picture; arguments as for `Camera.framing`.

    `towards` is a direction from the target to an eye whose distance is chosen. What the arguments leave open, the
    height of an orthographic picture or the distance of a perspective eye, is the largest that any angle asks for,
    so that it does not depend on the number of views. A single picture of the first view may be framed closer.
    """
    # Decides where the camera looks from.
    start = eye if towards is None else tuple(volume.centre + 2 * volume.radius * np.array(towards))
    first = Camera.framing(volume, projection, eye=start, height=height, aspect=aspect, **others)
    if turn is not None and (turn.rows > 1 or turn.direction(first, volume) is not None):
        count = _ANGLES if turn.rows == 1 else _COLUMNS * turn.rows
        views = list(cameras(first, count, replace(turn, turns=1.0), volume))
        framed = _framed_in(views, first, volume, aspect, keeps_height=height is not None)
        return framed if eye is None else replace(first, height=framed.height)
    axis = _axis(first)
    corners = volume.corners_from_centre + (volume.centre - first.target)
    above = corners @ axis  # heights of the box's corners above the target, along the axis
    out = np.linalg.norm(corners - above[:, np.newaxis] * axis, axis=1)  # and their distances from the axis
    sine = float(-first.forward @ axis)  # of the elevation: how steeply the camera looks down
    cosine = float(np.sqrt(max(1 - sine**2, 0.0)))
    # A corner `above` the target along the axis and `out` from the axis is, at an angle φ to the eye's side of it,
    #   out sin φ to the right,   above cosine - out cos φ sine upwards,   above sine + out cos φ cosine nearer.
    nearest = float((above * sine + out * cosine).max())
    if projection == "orthographic":
        if height is None:
            upwards = float((np.abs(above) * cosine + out * abs(sine)).max())
            first = replace(first, height=2 * FRAMING_MARGIN * max(upwards, float(out.max()) / aspect))
        # What lies behind the plane of the eye is not seen; the box is not when the target is its middle.
        distance = max(2 * volume.radius, FRAMING_MARGIN * nearest)
    else:
        # |up| / slope + nearer is convex in cos φ: largest at ±1. The same with |right|, a sine, has the amplitude of
        # the sum of a sine and a cosine.
        slope = first.half_height / FRAMING_MARGIN
        ends = (np.abs(above * cosine - sign * out * sine) / slope + sign * out * cosine for sign in (1.0, -1.0))
        sideways = out * np.hypot(1 / (slope * aspect), cosine)
        distance = float((np.maximum(np.maximum(*ends), sideways) + above * sine).max())
    return first.at_distance(distance) if eye is None else first


def _framed_in(views: Sequence[Camera], first: Camera, volume: Volume, aspect: float, *, keeps_height: bool) -> Camera:
    """Return the first camera with the distance, or the height, by which the whole box stays in all views."""
    if first.projection == "perspective":
        return first.at_distance(max(each.fitting_distance(volume, aspect) for each in views))
    about = volume.centre - np.array(first.target)
    places = np.array([each.in_eye_space(volume.corners_from_centre, about + each.eye) for each in views])
    across, above = (float(np.abs(places[..., axis]).max()) for axis in (0, 1))
    if not keeps_height:
        first = replace(first, height=2 * FRAMING_MARGIN * max(above, across / aspect))
    return first.at_distance(max(2 * volume.radius, FRAMING_MARGIN * -float(places[..., 2].min())))


def _axis(camera: Camera) -> np.ndarray:
    """Unit vector of the axis, shape (3)."""
    return np.array(camera.up) / np.linalg.norm(camera.up)
