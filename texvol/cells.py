"""Cells: small boxes of samples with the range of values in them, visible or not by the transfer function.

A cell spans `CELL` samples along each axis, or more in volumes so large that the cells would fill a texture. Its range
holds every value that interpolation can give inside it, the next samples all around included. So where the transfer
function is nothing over a cell's range nothing is in the cell, classified before interpolation or after. Of these cells
the `leaps` are made: how far all around a cell everything is as empty, or as full, as the cell itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.transfer import TransferFunction
from texvol.volume import Volume

CELL = 8  # samples: smaller ones follow the matter closer and cost more leaps
_MOST_CELLS = 512  # along an axis
_FARTHEST_LEAP = 16  # cells; one pass over the cells for each


@dataclass(frozen=True)
class Cells:
    """Ranges of values of a volume's cells, NaN where a cell has no other value.

    Attributes
    ----------
    lowest, highest : arrays of shape (cz, cy, cx)
    size : (x, y, z)
        Samples per cell.
    per_box : (x, y, z)
        Cells in the box, with the share of the last ones that lies inside.
    """

    lowest: NDArray
    highest: NDArray
    size: tuple[int, int, int]
    per_box: tuple[float, float, float]

    @classmethod
    def of(cls, volume: Volume) -> Cells:
        """The cells of a volume: two passes over its values."""
        size = tuple(max(CELL, -(-count // _MOST_CELLS)) for count in volume.dimensions)
        lowest, highest = _reduced(volume.values, size, np.fmin), _reduced(volume.values, size, np.fmax)
        x, y, z = (count / each for count, each in zip(volume.dimensions, size, strict=True))
        return cls(lowest, highest, size, (x, y, z))  # type: ignore[arg-type]

    def visible(self, transfer_function: TransferFunction) -> NDArray[np.bool_]:
        """Which cells may show anything, shape (cz, cy, cx)."""
        return transfer_function.shows_between(self.lowest, self.highest)

    def leaps(self, visible: NDArray[np.bool_]) -> NDArray[np.uint8]:
        """For each cell 2 r + visible, where all cells less than r away, along the axes and diagonals, are like it."""
        alike_empty, alike_full = ~visible, visible
        reach = np.ones(visible.shape, np.uint8)
        for _ in range(_FARTHEST_LEAP - 1):
            alike_empty, alike_full = _eroded(alike_empty), _eroded(alike_full)
            alike = alike_empty | alike_full
            if not alike.any():
                break
            reach += alike
        return 2 * reach + visible


def _reduced(values: NDArray, size: tuple[int, ...], reduce: np.ufunc) -> NDArray:
    """Least or largest value of each cell and the samples next to it, shape (cz, cy, cx); one axis after the other."""
    for axis, count in zip(range(3), reversed(size), strict=True):
        starts = np.arange(0, values.shape[axis], count)
        inner = _grouped(values, axis, count, reduce)
        before = values.take(np.maximum(starts - 1, 0), axis=axis)
        after = values.take(np.minimum(starts + count, values.shape[axis] - 1), axis=axis)
        values = reduce(reduce(inner, before), after)
    return values


def _grouped(values: NDArray, axis: int, count: int, reduce: np.ufunc) -> NDArray:
    """`values` reduced over each `count` neighbours along an axis, the last of fewer."""
    length = values.shape[axis]
    groups = length // count
    whole = np.moveaxis(values, axis, 0)[: groups * count]
    parts = [reduce.reduce(whole.reshape(groups, count, *whole.shape[1:]), axis=1)] if groups else []
    if length % count:
        parts.append(reduce.reduce(np.moveaxis(values, axis, 0)[groups * count :], axis=0, keepdims=True))
    return np.moveaxis(np.concatenate(parts), 0, axis)


def _eroded(alike: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which cells are set with all their 26 neighbours; what lies outside the box is like the cell."""
    for axis in range(3):
        along = np.moveaxis(alike, axis, 0)
        shrunk = along.copy()
        shrunk[1:] &= along[:-1]
        shrunk[:-1] &= along[1:]
        alike = np.moveaxis(shrunk, 0, axis)
    return alike
