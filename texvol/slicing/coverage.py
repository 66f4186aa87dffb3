"""Coverage of the screen: which pixels a part of the box can reach, and which of them are opaque already."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.slicing.slabs import slab_stacks

_MORE = 4.0  # times the box's radius: one slab as thick holds all of it


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
    stacks = slab_stacks(volume, camera, _MORE * volume.radius, size, part=part)
    width, height = size
    nothing = (slice(0, 0), slice(0, 0)), np.zeros((0, 0), np.bool_)
    if not stacks.first.size:
        return nothing
    corners = (stacks.polygons.reshape(-1, 2) * [1, -1] + 1) * np.array(size) / 2  # of pixels, from the top left
    low = np.clip(np.floor(corners.min(axis=0)), 0, size).astype(int)
    high = np.clip(np.ceil(corners.max(axis=0)), 0, size).astype(int)
    if (high <= low).any():
        return nothing
    x = np.arange(low[0], high[0]) + 0.5
    y = (np.arange(low[1], high[1]) + 0.5)[:, np.newaxis]
    inside = np.zeros((high[1] - low[1], high[0] - low[0]), np.bool_)
    for polygon in stacks.polygons:
        within = np.ones_like(inside)
        points = (polygon * [1, -1] + 1) * np.array([width, height]) / 2
        # Clockwise on a screen whose rows go down.
        for (ax, ay), (bx, by) in zip(points, np.roll(points, -1, axis=0), strict=True):
            within &= (bx - ax) * (y - ay) - (by - ay) * (x - ax) <= 1e-6 * (abs(bx - ax) + abs(by - ay) + 1)
        inside |= within
    return (slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))), inside
