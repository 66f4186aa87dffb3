"""Coverage of the screen: which pixels a part of the box can reach, and which of them are opaque already."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.slicing.slabs import box_corners, convex_hull

_NEAR = 1e-6  # depths, in radii of the box, that are too close to the eye to be projected
_ROUNDING = 1e-4  # pixels


def pixels_of(
    volume: Volume, camera: Camera, size: tuple[int, int], part: NDArray[np.float64]
) -> tuple[tuple[slice, slice], NDArray[np.bool_]]:
    """Return the rows and columns around the pixels that a part of the box may cover, and which of these it may.

    Parameters
    ----------
    part : array of shape (2, 3)
        Low and high corner, in fractions of the box.

    Returns
    -------
    (rows, columns), array of shape (height, width) of these; empty where the part is not on the screen.
    """
    nothing = (slice(0, 0), slice(0, 0)), np.zeros((0, 0), np.bool_)
    corners = box_corners(volume, camera, part)[:, :3]
    depth, perspective = corners[:, 2:], camera.projection == "perspective"
    if perspective and (depth <= 0).all():
        return nothing
    width, height = size
    scale = height / 2 / camera.half_height  # pixels per world unit, at depth 1 in perspective
    if perspective and (depth <= _NEAR * volume.radius).any():
        return (slice(0, height), slice(0, width)), np.ones((height, width), np.bool_)
    # From the top left: rows go down.
    points = corners[:, :2] * [1, -1] * (scale / depth if perspective else scale) + np.array(size) / 2
    low = np.clip(np.floor(points.min(axis=0)), 0, size).astype(int)
    high = np.clip(np.ceil(points.max(axis=0)), 0, size).astype(int)
    if (high <= low).any():
        return nothing
    a = np.array(convex_hull((across, down) for across, down in points.tolist()))
    edges = np.roll(a, -1, axis=0) - a
    # Each row has an interval between edges that go up and edges that go down; a level one has all of it, or nothing.
    # A pixel on the edge belongs to it, whatever rounding says.
    y = (np.arange(low[1], high[1]) + 0.5)[:, np.newaxis]
    slack = _ROUNDING * np.abs(edges).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = a[:, 0] + (edges[:, 0] * (y - a[:, 1]) + slack) / edges[:, 1]
    first = np.fmax.reduce(ends, axis=1, where=edges[:, 1] < 0, initial=-np.inf, keepdims=True)
    last = np.fmin.reduce(ends, axis=1, where=edges[:, 1] >= 0, initial=np.inf, keepdims=True)
    x = np.arange(low[0], high[0]) + 0.5
    return (slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))), (first <= x) & (x <= last)


def pixel_boxes_of(
    volume: Volume, camera: Camera, size: tuple[int, int], parts: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return boxes of pixels, first and behind the last column and row, outside of which parts of the box do not show.

    Parameters
    ----------
    parts : array of shape (n, 2, 3)
        Low and high corners, in fractions of the box.

    Returns
    -------
    Two arrays of shape (n, 2); equal where a part is not on the screen.
    """
    bits = (np.arange(8)[:, np.newaxis] >> np.arange(3)) & 1
    corners = parts[:, bits, np.arange(3)]
    places = camera.in_eye_space((corners - 0.5) @ volume.box_edges.T, volume.centre)
    depth, perspective = places[..., 2], camera.projection == "perspective"
    scale = size[1] / 2 / camera.half_height
    with np.errstate(divide="ignore", invalid="ignore"):
        per_unit = scale / depth if perspective else np.full(depth.shape, scale)
        points = places[..., :2] * [1, -1] * per_unit[..., np.newaxis]
    points += np.array(size) / 2
    if perspective:  # what reaches the eye may be anywhere
        near = (depth <= _NEAR * volume.radius).any(axis=1)
        points[near, 0], points[near, 1:] = 0.0, np.array(size, float)
        points[(depth <= 0).all(axis=1)] = -1.0  # off the screen
    low = np.clip(np.floor(points.min(axis=1) - _ROUNDING), 0, size).astype(np.intp)
    high = np.clip(np.ceil(points.max(axis=1) + _ROUNDING), 0, size).astype(np.intp)
    return low, np.maximum(low, high)


def in_common(
    one: tuple[slice, slice], other: tuple[slice, slice]
) -> tuple[tuple[slice, ...], tuple[slice, ...]] | None:
    """Return what two boxes of pixels have in common, counted from the corner of each; None if that is nothing."""
    low = [max(a.start, b.start) for a, b in zip(one, other, strict=True)]
    high = [min(a.stop, b.stop) for a, b in zip(one, other, strict=True)]
    if low[0] >= high[0] or low[1] >= high[1]:
        return None
    here, there = (
        tuple(slice(a - w.start, b - w.start) for a, b, w in zip(low, high, box, strict=True)) for box in (one, other)
    )
    return here, there
