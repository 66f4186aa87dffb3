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
    x = np.arange(low[0], high[0]) + 0.5
    y = (np.arange(low[1], high[1]) + 0.5)[:, np.newaxis]
    inside = np.ones((high[1] - low[1], high[0] - low[0]), np.bool_)
    outline = np.array(convex_hull((across, down) for across, down in points.tolist()))
    for (ax, ay), (bx, by) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        # A pixel on the edge belongs to it, whatever rounding says.
        inside &= (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= -_ROUNDING * (abs(bx - ax) + abs(by - ay))
    return (slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))), inside
