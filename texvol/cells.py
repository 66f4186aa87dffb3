"""Cells: small boxes of samples with the range of values in them, visible or not by the transfer function.

A cell spans `CELL` samples along each axis, or more in volumes so large that the cells would fill a texture. Its range
holds every value that interpolation can give inside it, the next samples all around included. So where the transfer
function is nothing over a cell's range nothing is in the cell, classified before interpolation or after. Of these cells
the `leaps` are made: how far all around a cell everything is as empty, or as full, as the cell itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.mask import Mask
from texvol.volume import Volume

CELL = 4  # samples: smaller ones follow the matter closer and cost more leaps, with no gain in time
_MOST_CELLS = 400_000  # so that a new transfer function has its leaps within a tenth of a second
_ROUNDED = 2.0**-14  # twice a rounding to 16 bits with a sign
_FARTHEST_LEAP = 16  # cells; one pass over the cells for each


class Shown(Protocol):
    """What knows which values show anything, such as a transfer function."""

    def shows_between(self, lowest: NDArray, highest: NDArray, largest_magnitude: ArrayLike) -> NDArray[np.bool_]:
        """Whether any value from `lowest` to `highest`, on gradients up to `largest_magnitude`, may be something."""


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
        cell = max(CELL, int(np.ceil((volume.values.size / _MOST_CELLS) ** (1 / 3))))
        size = (cell, cell, cell)
        lowest, highest = _reduced(volume.values, size, np.fmin), _reduced(volume.values, size, np.fmax)
        x, y, z = (count / each for count, each in zip(volume.dimensions, size, strict=True))
        return cls(lowest, highest, size, (x, y, z))

    def visible(self, shown: Shown, steepest: ArrayLike = np.inf, mask: Mask | None = None) -> NDArray[np.bool_]:
        """Which cells may show anything, shape (cz, cy, cx), on gradients up to `steepest`, of what a mask leaves."""
        visible = shown.shows_between(self.lowest, self.highest, steepest)
        return visible if mask is None else visible & (_reduced(mask.array, self.size, np.fmax) > 0)

    def steepest(self, volume: Volume, reach: int) -> NDArray[np.float64]:
        """The most that a gradient's magnitude may be in each cell, data units per world unit, shape (cz, cy, cx).

        `reach` is how many samples to each side a gradient depends on. A derivative is a mean of differences of
        neighbours, so that it is no larger than the range of the values within its reach. Where samples are missing,
        or values are labels, nothing is said.
        """
        if volume.has_missing or volume.labels:
            return np.full(self.lowest.shape, np.inf)
        lowest, highest = self.lowest.astype(np.float64), self.highest.astype(np.float64)
        for _ in range(-(-reach // min(self.size))):
            lowest, highest = _spread(lowest, np.minimum), _spread(highest, np.maximum)
        with np.errstate(over="ignore", invalid="ignore"):
            most = (highest - lowest) * np.linalg.norm(volume.index_from_world, axis=1).sum()
        # Texels of gradients may be rounded to 16 bits of the largest.
        return np.nan_to_num(most + _ROUNDED * most.max(), nan=np.inf, posinf=np.inf)

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
    """Least or largest value of each cell and the samples beside it, shape (cz, cy, cx); a layer of cells at a time."""
    nx, ny, nz = size
    layers = []
    for z in range(0, len(values), nz):
        layer = reduce.reduce(values[max(z - 1, 0) : z + nz + 1], axis=0)
        layers.append(_along_rows(_along_rows(layer, ny, reduce).T, nx, reduce).T)
    return np.stack(layers)


def _along_rows(values: NDArray, count: int, reduce: np.ufunc) -> NDArray:
    """Rows (n, m) reduced over each `count` neighbours, the last of fewer, and the rows before and after them."""
    values = np.ascontiguousarray(values)
    starts = np.arange(0, len(values), count)
    inner = reduce.reduceat(values, starts, axis=0)
    before, after = np.maximum(starts - 1, 0), np.minimum(starts + count, len(values) - 1)
    return reduce(reduce(inner, values[before]), values[after])


def _spread(numbers: NDArray, reduce: np.ufunc) -> NDArray:
    """The least or largest of each cell and its 26 neighbours."""
    for axis in range(3):
        along = np.moveaxis(numbers, axis, 0)
        spread = along.copy(order="K")
        reduce(spread[1:], along[:-1], out=spread[1:])
        reduce(spread[:-1], along[1:], out=spread[:-1])
        numbers = np.moveaxis(spread, 0, axis)
    return numbers


def _eroded(alike: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which cells are set with all their 26 neighbours; what lies outside the box is like the cell."""
    for axis in range(3):
        along = np.moveaxis(alike, axis, 0)
        shrunk = along.copy(order="K")  # as it lies in memory: a transposed copy takes ten times as long
        shrunk[1:] &= along[:-1]
        shrunk[:-1] &= along[1:]
        alike = np.moveaxis(shrunk, 0, axis)
    return alike
