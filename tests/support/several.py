"""Scenes of several volumes, and what overlapping constant boxes look like in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from support.closed_forms import mean_transmittance, opacity
from support.scenes import constant
from texvol import Camera, Scene, Volume
from texvol.scene.added_volume import AddedVolume
from texvol.scene.cutting import ClipPlane

Numbers = NDArray[np.float64]
Triple = tuple[float, float, float]
Box = tuple[Volume, float, Triple]  # with its extinction and colour


def turned(degrees: float, axis: ArrayLike = (1, 2, 3), shift: ArrayLike = (0, 0, 0)) -> Numbers:
    """A rotation about the world's origin, and a shift after it, as a 4 x 4 matrix (Rodrigues)."""
    x, y, z = np.array(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    matrix[:3, 3] = shift
    return matrix


def boxes(density: float = 1.0) -> list[Box]:
    """Three boxes of constant matter at angles to each other; a part of space lies in all of them."""
    one = Volume(np.ones((8, 9, 10), np.float32), (1, 1.1, 0.9))
    two = Volume(np.ones((5, 6, 7), np.uint8), (1.7, 1.2, 1.4)).moved(turned(37, shift=(2, 1, 3)))
    three = Volume(np.ones((3, 3, 3), np.int16), (4, 3, 2)).moved(turned(70, (1, -2, 1), (4, -1, 1)))
    return [
        (one, 0.05 * density, (1.0, 0.1, 0.0)),
        (two, 0.08 * density, (0.0, 1.0, 0.2)),
        (three, 0.03 * density, (0.2, 0.3, 1.0)),
    ]


def scene_of(parts: Sequence[Box], **more: object) -> Scene:
    """All boxes in one scene."""
    (volume, extinction, color), *others = parts
    added = tuple(AddedVolume(each, constant(tau, tint)) for each, tau, tint in others)
    return Scene(volume, constant(extinction, color), added=added, **({"classification": "slab"} | more))  # type: ignore[arg-type]


def picture_of(
    parts: Sequence[Box], camera: Camera, size: tuple[int, int], planes: Sequence[ClipPlane] = ()
) -> Numbers:
    """The picture in closed form: between the ends of the boxes each ray is in constant matter."""
    eyes, directions = camera.rays(size)
    near, far = np.zeros(directions.shape[:2]), np.full(directions.shape[:2], np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for plane in planes:
            height, rise = eyes @ np.array(plane.normal) - plane.offset, directions @ np.array(plane.normal)
            near = np.where(rise > 0, np.maximum(near, -height / rise), near)
            far = np.where(rise < 0, np.minimum(far, -height / rise), far)
        spans = [_span(volume, eyes, directions, near, far) for volume, *_ in parts]
    cuts = np.sort(np.concatenate([np.stack(span) for span in spans]), axis=0)
    picture = np.zeros((*near.shape, 4))
    for front, back in pairwise(cuts):
        middle, length = (front + back) / 2, back - front
        glow, depth = np.zeros((*near.shape, 3)), np.zeros(near.shape)
        for (enters, leaves), (_, extinction, color) in zip(spans, parts, strict=True):
            inside = (enters < middle) & (middle < leaves)
            depth += inside * extinction * length
            glow += (inside * extinction * length)[..., np.newaxis] * np.array(color)
        seen = 1 - picture[..., 3:]
        picture[..., :3] += seen * glow * mean_transmittance(depth)[..., np.newaxis]
        picture[..., 3:] += seen * opacity(depth)[..., np.newaxis]
    return picture


def _span(volume: Volume, eyes: Numbers, directions: Numbers, near: Numbers, far: Numbers) -> tuple[Numbers, Numbers]:
    """Where rays are in a volume's box, and between `near` and `far`."""
    to_box = np.linalg.inv(volume.box_edges)
    position, direction = (eyes - volume.box_corner) @ to_box.T, directions @ to_box.T
    a, b = -position / direction, (1 - position) / direction
    enters = np.maximum(np.minimum(a, b).max(axis=-1), near)
    return enters, np.maximum(np.minimum(np.maximum(a, b).min(axis=-1), far), enters)
