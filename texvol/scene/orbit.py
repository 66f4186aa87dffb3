"""Cameras that turn around a scene.

The axis goes through the target along `up`. With k the unit vector of the axis and p the part of eye - target across
it, the eye that is turned by an angle θ, counterclockwise as seen from the tip of `up`, is

    eye(θ) = eye + (cos θ - 1) p + sin θ k × p        (Rodrigues, less eye(0) = eye)

Height above the target, distance and `up` stay, so that every view is a rotation of the first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from texvol.scene.camera import FRAMING_MARGIN, Camera, Projection
from texvol.scene.volume import Volume


def turned(camera: Camera, degrees: float) -> Camera:
    """The camera, turned about the axis through its target along its `up`; in float64.

    Turned by 0 it is the same camera to the last bit: what is added to the eye is 0 then, wherever the world's origin
    is. 1 - cos θ is written 2 sin² θ/2, which keeps its digits for small steps.
    """
    angle = np.radians(degrees)
    axis = _axis(camera)
    offset = np.subtract(camera.eye, camera.target)
    across = offset - (offset @ axis) * axis
    moved = np.sin(angle) * np.cross(axis, across) - 2 * np.sin(angle / 2) ** 2 * across
    return replace(camera, eye=tuple(np.array(camera.eye) + moved))


def framing(
    volume: Volume,
    projection: Projection = "orthographic",
    *,
    eye: Sequence[float] | None = None,
    towards: ArrayLike | None = None,
    height: float | None = None,
    aspect: float = 1.0,
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


def _axis(camera: Camera) -> np.ndarray:
    """Unit vector of the axis, shape (3)."""
    return np.array(camera.up) / np.linalg.norm(camera.up)
