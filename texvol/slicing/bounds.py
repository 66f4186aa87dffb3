"""Bounds: the largest or least value in small cells, so that a ray skips cells that cannot raise what it has met.

A cell spans a few samples from plane to plane: cell c of side s holds what is interpolated between the planes through
the samples s c - 1 and s (c + 1) - 1 along each axis, and the outermost cells what lies beyond. A large cell is 4 small
ones along each axis: rays look into those whose bound is larger than what they know only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume

Triple = tuple[int, int, int]
CELL = 4  # samples along an axis: 2 and 3 take as long, and more memory
_LARGE = 4  # small cells along the side of a large one, as in best_cells.glsl: 2 takes as long
_MOST_ALONG_AN_AXIS = 1632  # small cells: with the large ones these are 2040 texels, and every device has room for 2048


def first_place_of(first: Triple, side: int) -> Triple:
    """Return where the large cells begin that hold the samples `first` along three axes."""
    x, y, z = (at // (_LARGE * side) * (_LARGE * side) for at in first)
    return x, y, z


def side_of(volume: Volume) -> int:
    """Return how many samples a cell spans along each axis."""
    return max(CELL, -(-max(volume.dimensions) // _MOST_ALONG_AN_AXIS))


def bounds_of(values: NDArray, side: int, reduce: np.ufunc, before: Triple = (0, 0, 0)) -> NDArray:
    """Return the largest or least value of each cell, as `reduce` is fmax or fmin, shape (cz, cy, cx).

    `before` are the samples along z, y, x from where the first cell begins to the first sample that there is. Cells
    with no sample have the value of the first one.
    """
    for first in before:  # along z, y and x, each of which is the first axis in its turn
        starts = range(-first, len(values), side)
        made = np.empty((len(starts), *values.shape[1:]), values.dtype)
        for layer, at in zip(made, starts, strict=True):
            reduce.reduce(values[max(at - 1, 0) : max(at + side, 1)], axis=0, out=layer)
        values = np.ascontiguousarray(made.transpose(1, 2, 0))
    return values


def with_large_cells(bounds: NDArray, reduce: np.ufunc, nothing: float) -> NDArray:
    """Return bounds of small cells and, behind them along z, of large ones; `nothing` is beside these."""
    large = bounds
    for _ in range(3):
        large = reduce.reduceat(large, range(0, len(large), _LARGE), axis=0).transpose(1, 2, 0)
    padding = [(0, small - count) for small, count in zip(bounds.shape, large.shape, strict=True)]
    return np.concatenate([bounds, np.pad(large, [(0, 0), *padding[1:]], constant_values=nothing)])
