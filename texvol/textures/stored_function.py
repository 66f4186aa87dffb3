"""A transfer function as the shader looks values up in it: in the units of a texture of values.

It is a sum of a few ramps, see `ramps`, or a table of segments. The table loses nothing, however many points there are
or how close: a segment between two control points is a line, and a grid over the values says between which segments to
search.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.scene import Classification
from texvol.scene.transfer import TransferFunction
from texvol.textures.ramps import STEP_MARGIN, ramp_uniforms
from texvol.textures.value_storage import Storage

_OPAQUE = 1e16  # extinction per smallest spacing that stands for all above: its square is a float32
_LAST = 3e38  # the end of the last segment
_TABLE_WIDTH = 4096  # segments in a row of the table; more go into further rows
_MOST_CELLS = 4096
_MOST_RAMPS = 12  # for `integrated`: with twice as many segments are as fast
_KEPT = 8  # functions; parts of a volume have one in common


@dataclass(frozen=True)
class StoredFunction:
    """Transfer function of values in some storage; extinction and emission are counted per `length_unit`."""

    function: TransferFunction
    storage: Storage
    classification: Classification
    length_unit: float

    @property
    def number_of_ramps(self) -> int:
        """Ramps that the shader adds up; 0 where it looks segments up."""
        return len(self._ramps["ramp_rises"]) if self._ramps else 0

    @property
    def uniforms(self) -> dict[str, Any]:
        """Uniforms of the shader that looks it up."""
        if self._ramps:
            return self._ramps
        low, high = self._grid_range
        return {"grid_low": low, "grid_per_value": self._cells / (high - low), "grid_cells": self._cells}

    @cached_property
    def tables(self) -> dict[str, NDArray[np.float32]]:
        """Two-dimensional textures, shape (rows, columns, 4); none where ramps do.

        `segments`, three rows for each 4096 segments: (start, end, extinction there and there), (colour at the start,
        1 if opaque from its start on, 2 if opaque above its start), (colour at the end, 1 / (end - start)).
        `segment_grid`: for each cell of the grid the first and the last segment that a value in it may lie in.
        """
        if self._ramps:
            return {}
        left, right, opaque = self.function.segment_ends
        numbers = self._numbers
        stored = self.storage.stored(self.function.values)
        # A value that lies exactly on a step is to its right, one on the point before an infinite one is not opaque.
        infinite = np.isinf(self.function.extinctions)
        same = np.diff(stored) == 0
        lower = np.append(same, False) | np.append(False, same) | infinite
        upper = np.append(infinite[1:], False) & ~infinite
        margin = STEP_MARGIN * np.abs(stored)
        points = (stored + np.where(upper, margin, np.where(lower, -margin, 0.0))).astype(np.float32)
        points = np.maximum.accumulate(points)
        start, end = points[left], points[right]
        table = np.zeros((3, left.size, 4))
        table[0, :, :2] = np.column_stack([start, np.append(end[:-1], _LAST)])
        table[0, :, 2:] = np.column_stack([numbers[left, 3], numbers[right, 3]])
        table[1, :, :3], table[2, :, :3] = numbers[left, :3], numbers[right, :3]
        table[1, :, 3] = np.where(opaque[:, 0], 1, np.where(opaque[:, 1], 2, 0))
        # From the ends as float32 has them: a value in between stays between its ends, however close they are.
        width = end.astype(np.float64) - start
        table[2, :, 3] = np.divide(1, width, out=np.zeros(width.size), where=width > 1e-37)
        rows = -(-left.size // _TABLE_WIDTH)
        padded = np.zeros((3, rows * _TABLE_WIDTH if rows > 1 else left.size, 4))
        padded[:, : left.size] = table
        segments = padded.reshape(3, rows, -1, 4).transpose(1, 0, 2, 3).reshape(rows * 3, -1, 4)
        return {
            "segments": np.clip(segments, -_LAST, _LAST).astype(np.float32),
            "segment_grid": self._grid(points),
        }

    def _grid(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        low, high = self._grid_range
        edges = np.linspace(low, high, self._cells + 1)
        # Half a cell on either side: float32 may find a value in the neighbour of its cell.
        margin = 0.5 * (edges[1] - edges[0])
        grid = np.zeros((1, self._cells, 4), np.float32)
        grid[0, :, 0] = np.searchsorted(points, edges[:-1] - margin, side="right")
        grid[0, :, 1] = np.searchsorted(points, edges[1:] + margin, side="right")
        grid[0, 0, 0], grid[0, -1, 1] = 0, points.size
        return grid

    @cached_property
    def _ramps(self) -> dict[str, Any] | None:
        """The transfer function as ramps, where that is possible; few of them for `integrated`."""
        if np.isinf(self.function.extinctions).any():
            return None
        positions = self.storage.stored(self.function.values)
        is_integrated = self.classification == "integrated"
        ramps = ramp_uniforms(positions, self._numbers, self.function.glows, contiguous=is_integrated)
        if ramps and is_integrated and len(ramps["ramp_rises"]) > _MOST_RAMPS:
            return None
        return ramps

    @property
    def _numbers(self) -> NDArray[np.float64]:
        """Colour or emission and extinction of each point, per `length_unit`, shape (n, 4)."""
        glow = self.length_unit if self.function.glows else 1.0
        numbers = self.function.numbers * [glow, glow, glow, self.length_unit]
        if self.function.premultiplied:
            # An opaque medium shows its straight colour, which knows no length.
            opaque = np.isinf(self.function.extinctions)
            numbers[opaque, :3] = self.function.colors[opaque]
        numbers[:, 3] = np.minimum(numbers[:, 3], _OPAQUE)
        return numbers

    @property
    def _cells(self) -> int:
        return int(min(_MOST_CELLS, max(64, 8 * self.function.values.size)))

    @property
    def _grid_range(self) -> tuple[float, float]:
        low, high = (float(end) for end in self.storage.stored(self.function.values[[0, -1]]))
        return (low, high) if high > low else (low - 1.0, low + 1.0)


@lru_cache(_KEPT)
def stored_function(
    function: TransferFunction, storage: Storage, classification: Classification, length_unit: float
) -> StoredFunction:
    """Return the `StoredFunction`, the same one for the same arguments."""
    return StoredFunction(function, storage, classification, length_unit)
