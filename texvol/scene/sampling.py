"""Values of a volume at points of the world: trilinear, or those of the nearest samples of labels and blocks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import LargeVolume
from texvol.scene.volume import Volume

_MOST_READ = 1 << 22  # samples of a store that are read at once


def sampled(volume: Volume, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values at world points, shape (n): trilinear, or nearest for labels; NaN outside the box.

    Of a large volume only the samples around the points are read, some points at a time.
    """
    if isinstance(volume, LargeVolume):
        return _of_store(volume, points)
    counts = np.array(volume.dimensions)
    index = (points - volume.origin) @ volume.index_from_world.T
    inside = ((index >= -0.5) & (index <= counts - 0.5)).all(axis=1)
    index = np.clip(index, 0, counts - 1)
    if volume.nearest:
        x, y, z = np.rint(index).astype(int).T
        return np.where(inside, volume.values[z, y, x].astype(np.float64), np.nan)
    low = np.minimum(index.astype(int), np.maximum(counts - 2, 0))
    fraction = index - low
    high = np.minimum(low + 1, counts - 1)
    result = np.zeros(len(points))
    for corner in range(8):
        bits = [(corner >> axis) & 1 for axis in range(3)]
        x, y, z = (np.where(bit, high[:, axis], low[:, axis]) for axis, bit in enumerate(bits))
        weight = np.prod([fraction[:, axis] if bit else 1 - fraction[:, axis] for axis, bit in enumerate(bits)], axis=0)
        with np.errstate(invalid="ignore"):
            result += np.where(weight > 0, weight * volume.values[z, y, x].astype(np.float64), 0.0)
    return np.where(inside, result, np.nan)


def _of_store(volume: LargeVolume, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values of a store: halves of the points apart, until the samples around them are few enough."""
    counts = np.array(volume.dimensions)
    index = (points - volume.origin) @ volume.index_from_world.T
    inside = ((index >= -0.5) & (index <= counts - 0.5)).all(axis=1)
    if not inside.any():
        return np.full(len(points), np.nan)
    near = np.clip(index[inside], 0, counts - 1)
    # One sample more on each side: rounding must not put a point outside the part's samples.
    first = np.maximum(np.floor(near.min(axis=0)).astype(int) - 1, 0)
    last = np.minimum(np.ceil(near.max(axis=0)).astype(int) + 2, counts)
    if np.prod(last - first, dtype=np.float64) > _MOST_READ and len(points) > 1:
        half = len(points) // 2
        return np.concatenate([_of_store(volume, points[:half]), _of_store(volume, points[half:])])
    x, y, z = (int(each) for each in first)
    part = volume.part(0, (x, y, z), (int(last[0]), int(last[1]), int(last[2])))
    return np.where(inside, sampled(part, points), np.nan)
