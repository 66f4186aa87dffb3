"""Cells: small boxes of samples with the range of values in them, visible or not by the transfer function.

A cell spans `CELL` samples along each axis, or more in volumes so large that the cells would fill a texture. Its range
holds every value that interpolation can give inside it, the next samples all around included. So where the transfer
function is nothing over a cell's range nothing is in the cell, classified before interpolation or after. Of these cells
the `skips` are made: how far on, in each octant of directions, everything is as empty, or as full, as the cell itself.
All around it were less by half: a ray that has passed a medium would take it for near.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.mask import Mask
from texvol.scene.volume import Volume
from texvol.util.statistics import on_steps

CELL = 3  # samples: smaller ones follow the medium closer, a twentieth less time, and take three times as long to make
_MOST_CELLS = 640_000  # so that a new transfer function has its skips within a tenth of a second
_ROUNDED = 2.0**-14  # twice a rounding to 16 bits with a sign
_MOST_ALONG_AN_AXIS = 1024  # a texture has two of them for each, and at least 2048 texels along an axis
_FARTHEST_SKIP = 16  # cells; one pass over the cells for each
# A bit for each octant of directions: 1 for those that go down along x, 2 along y, 4 along z. Which of them go down:
_DOWN = {"x": 0b10101010, "y": 0b11001100, "z": 0b11110000}


class Shown(Protocol):
    """Anything that knows which values show, such as a transfer function."""

    def shows_between(self, lowest: NDArray, highest: NDArray, largest_magnitude: ArrayLike) -> NDArray[np.bool_]:
        """True where any value from `lowest` to `highest` may show, for gradients up to `largest_magnitude`."""


@dataclass(frozen=True)
class Cells:
    """Ranges of values of a volume's cells, NaN where a cell has no other value."""

    lowest: NDArray  # shape (cz, cy, cx)
    highest: NDArray
    size: tuple[int, int, int]  # samples per cell along x, y, z
    per_box: tuple[float, float, float]  # cells in the box, with the fraction of the last ones that lies inside

    @classmethod
    def of(cls, volume: Volume, of_samples: float | None = None) -> Cells:
        """The cells of a volume: two passes over its values.

        Those of a part are as large as those of the whole volume, which has so many samples.
        """
        cell = cell_side(of_samples or volume.size)
        nx, ny, nz = (max(cell, -(-count // _MOST_ALONG_AN_AXIS)) for count in volume.dimensions)
        size = (nx, ny, nz)
        lowest, highest = _reduced(volume.values, size, np.fmin), _reduced(volume.values, size, np.fmax)
        x, y, z = (count / each for count, each in zip(volume.dimensions, size, strict=True))
        return cls(lowest, highest, size, (x, y, z))

    def widened(self, spread: NDArray, reach: Callable[[NDArray], NDArray[np.float64]]) -> Cells:
        """Return the cells if samples stand for values around their own: `reach` says how far, for their `spread`."""
        most = reach(_reduced(spread, self.size, np.maximum))
        return replace(self, lowest=self.lowest - most, highest=self.highest + most)

    def visible(
        self,
        shown: Shown,
        steepest: ArrayLike = np.inf,
        mask: Mask | None = None,
        steps: tuple[float, float] | None = None,
    ) -> NDArray[np.bool_]:
        """Return the cells that may show, shape (cz, cy, cx), for gradients up to `steepest` and a mask.

        `steps` are those to which values are rounded before they are interpolated.
        """
        lowest, highest = self.lowest, self.highest
        if steps is not None:
            lowest, highest = on_steps(lowest, *steps), on_steps(highest, *steps)
        visible = shown.shows_between(lowest, highest, steepest)
        return visible if mask is None else visible & (_reduced(mask.array, self.size, np.fmax) > 0)

    def steepest(self, volume: Volume, reach: int) -> NDArray[np.float64]:
        """The most that a gradient's magnitude may be in each cell, data units per world unit, shape (cz, cy, cx).

        `reach` is how many samples to each side a gradient depends on. A derivative is a mean of differences of
        neighbours, so that it is no larger than the range of the values within its reach. Where samples are missing,
        or values are labels, nothing is said.
        """
        if volume.has_missing or volume.nearest:
            return np.full(self.lowest.shape, np.inf)
        lowest, highest = self.lowest.astype(np.float64), self.highest.astype(np.float64)
        for _ in range(-(-reach // min(self.size))):
            lowest, highest = _spread(lowest, np.minimum), _spread(highest, np.maximum)
        with np.errstate(over="ignore", invalid="ignore"):
            most = (highest - lowest) * np.linalg.norm(volume.index_from_world, axis=1).sum()
        # Texels of gradients may be rounded to 16 bits of the largest.
        return np.nan_to_num(most + _ROUNDED * most.max(), nan=np.inf, posinf=np.inf)

    def skips(self, visible: NDArray[np.bool_]) -> NDArray[np.uint8]:
        """Return `skips_of` cells of which it is known which are visible."""
        return skips_of(visible)


def skips_of(visible: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return 2 r + visible for each octant of directions and each cell, shape (2 cz, 2 cy, 2 cx).

    All cells less than r away are like it, along the axes and diagonals of the octant. The first half along an axis
    is for directions that go up along it, the second for those that go down.
    """
    reach = np.full((8, *visible.shape), _FARTHEST_SKIP, np.uint8)
    if visible.any() and not visible.all():
        _find_reach(reach, visible)
    cz, cy, cx = visible.shape
    by_axis = (2 * reach + visible).reshape(2, 2, 2, cz, cy, cx).transpose(0, 3, 1, 4, 2, 5)
    return by_axis.reshape(2 * cz, 2 * cy, 2 * cx)


def _find_reach(reach: NDArray[np.uint8], visible: NDArray[np.bool_]) -> None:
    """Fill in how far from each cell the first one of the other kind is, in each octant."""
    empty = np.where(visible, np.uint8(0), np.uint8(255))
    alike = np.stack([empty, ~empty])
    up, down = _beyond_rows(alike.shape)
    octants = np.arange(8, dtype=np.uint8).reshape(8, 1, 1, 1)
    left = _FARTHEST_SKIP - 1
    reach[:] = 1
    while left:
        alike = _eroded(alike, up, down)
        of_a_kind = alike[0] | alike[1]
        if not of_a_kind.any():
            break
        # What is alike for as many cells as the longest axis has, is so for all that are asked for.
        steps = 1 if _FARTHEST_SKIP - left < max(visible.shape) else left
        alike_in = of_a_kind >> octants
        alike_in &= 1
        reach += alike_in if steps == 1 else steps * alike_in
        left -= steps


def cell_side(samples: float) -> int:
    """Return how many samples the cells of a volume of so many samples span along each axis."""
    return max(CELL, int(np.ceil((samples / _MOST_CELLS) ** (1 / 3))))


def _reduced(values: NDArray, size: tuple[int, ...], reduce: np.ufunc) -> NDArray:
    """Least or largest value of each cell and the samples beside it, shape (cz, cy, cx)."""
    nx, ny, nz = size
    in_columns = _along(_along(values, 0, nz, reduce), 1, ny, reduce)
    # Along rows numpy takes as long for each cell as for many samples: so x becomes the first axis.
    return np.ascontiguousarray(
        _along(np.ascontiguousarray(in_columns.transpose(2, 0, 1)), 0, nx, reduce).transpose(1, 2, 0)
    )


def _along(values: NDArray, axis: int, count: int, reduce: np.ufunc) -> NDArray:
    """Samples reduced along an axis over each `count`, the last of fewer, and the ones before and after them."""
    shape = list(values.shape)
    shape[axis] = -(-shape[axis] // count)
    made = np.empty(shape, values.dtype)
    before: tuple[slice | int, ...] = (slice(None),) * axis
    for cell in range(shape[axis]):
        samples = slice(max(cell * count - 1, 0), (cell + 1) * count + 1)
        reduce.reduce(values[(*before, samples)], axis=axis, out=made[(*before, cell)])
    return made


def _spread(numbers: NDArray, reduce: np.ufunc) -> NDArray:
    """The least or largest of each cell and its 26 neighbours."""
    for axis in range(3):
        along = np.moveaxis(numbers, axis, 0)
        spread = along.copy(order="K")
        reduce(spread[1:], along[:-1], out=spread[1:])
        reduce(spread[:-1], along[1:], out=spread[:-1])
        numbers = np.moveaxis(spread, 0, axis)
    return numbers


def _beyond_rows(shape: tuple[int, ...]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return for cells and octants where the next cell of a row does not matter, and where the one before."""
    up, down = np.full(shape, _DOWN["x"], np.uint8), np.full(shape, 255 - _DOWN["x"], np.uint8)
    up[..., -1] = down[..., 0] = 255
    return up, down


def _eroded(alike: NDArray[np.uint8], up: NDArray[np.uint8], down: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return for each octant the cells, (…, cz, cy, cx), that are set together with their 7 neighbours in it.

    `up` and `down` are `_beyond_rows` of the shape.
    """
    for axis, goes_down in ((1, _DOWN["z"]), (2, _DOWN["y"])):
        here, next_one = ((slice(None),) * axis + (part,) for part in (slice(None, -1), slice(1, None)))
        shrunk = alike.copy()
        shrunk[here] &= alike[next_one] | np.uint8(goes_down)
        shrunk[next_one] &= alike[here] | np.uint8(255 - goes_down)
        alike = shrunk
    # Rows are short, and each takes numpy as long as many cells: along them all at once, but for what is beyond an end.
    shrunk = alike.copy()
    flat, before, up, down = (each.reshape(-1) for each in (shrunk, alike, up, down))
    flat[:-1] &= before[1:] | up[:-1]
    flat[1:] &= before[:-1] | down[1:]
    return shrunk
