"""Classification after interpolation: the value as a 3D texture, the transfer function as a table of segments.

    post         one value in the middle of each slab, looked up in the transfer function
    integrated   values at both ends and in the middle of each slab; the transfer function is integrated exactly along
                 the two lines between them

The value keeps the data's own type where the driver interpolates that exactly: 16 bits for integers of 8 and 16 (Mesa
interpolates 8-bit texels with 8-bit weights, 7e-3 off; 16-bit ones to 1e-7), half and single precision as they are.
What is wider is stored relative to the middle of its range, so that 1e9 ± 1 stays apart.

The table loses nothing, however many points there are or how close: a segment between two control points is a line, and
a grid over the values says between which segments to search.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene import Classification
from texvol.transfer import TransferFunction
from texvol.volume import Volume

_OPAQUE = 1e16  # extinction per smallest spacing that stands for all above: its square is a float32
_LAST = 3e38  # the end of the last segment
_TABLE_WIDTH = 4096  # segments in a row of the table; more go into further rows
_MOST_CELLS = 4096
_HUGE = 1e30  # stands for an infinite sample or value: any weight above 1e-24 takes it past every control point
# Interpolation may round equal texels down by half an ulp or two: without this a flat region that lies exactly on a
# step would fall to its left side. In shares of the stored value.
_STEP_MARGIN = 2.0**-22


@dataclass(frozen=True)
class ValueTexture:
    """Values of shape (nz, ny, nx, 1) as the texture holds them, and the transfer function in the same units.

    A fetched value v stands for `offset + scale * v` in data units. `length_unit` (world units) is what extinction and
    emission are counted per.
    """

    texels: NDArray
    texel_format: str
    offset: float
    scale: float
    transfer_function: TransferFunction
    classification: Classification
    length_unit: float

    def without_texels(self) -> ValueTexture:
        """The same, its texels let go: what a drawing needs to know once they are on the device."""
        return replace(self, texels=np.empty((0, 0, 0, 1), self.texels.dtype))

    @property
    def switches(self) -> dict[str, int]:
        """Switches of the shader."""
        return {"CLASSIFICATION": 2 if self.classification == "post" else 3}

    def uniforms(self, slab_thickness: float) -> dict[str, Any]:
        """Uniforms of the shader."""
        low, high = self._grid_range
        return {
            "slab_length": slab_thickness / self.length_unit,
            "grid_low": low,
            "grid_per_value": self._cells / (high - low),
            "grid_cells": self._cells,
            "emissive": self.transfer_function.emissive,
        }

    @cached_property
    def tables(self) -> dict[str, NDArray[np.float32]]:
        """Two-dimensional textures, shape (rows, columns, 4).

        `segments`, three rows for each 4096 segments: (start, end, extinction there and there), (colour at the start,
        1 if opaque from its start on, 2 if opaque above its start), (colour at the end, 1 / (end - start)).
        `segment_grid`: for each cell of the grid the first and the last segment that a value in it may lie in.
        """
        left, right, opaque = self.transfer_function.segment_ends
        glow = self.length_unit if self.transfer_function.emissive else 1.0
        numbers = self.transfer_function.numbers * [glow, glow, glow, self.length_unit]
        numbers[:, 3] = np.minimum(numbers[:, 3], _OPAQUE)
        stored = self._stored(self.transfer_function.values)
        points = (stored - _STEP_MARGIN * np.abs(stored)).astype(np.float32)
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

    @property
    def _cells(self) -> int:
        return int(min(_MOST_CELLS, max(64, 8 * self.transfer_function.values.size)))

    @property
    def _grid_range(self) -> tuple[float, float]:
        low, high = (float(end) for end in self._stored(self.transfer_function.values[[0, -1]]))
        return (low, high) if high > low else (low - 1.0, low + 1.0)

    def _stored(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        return (values - self.offset) / self.scale


def bake_values(volume: Volume, transfer_function: TransferFunction, classification: Classification) -> ValueTexture:
    """The volume's values as a texture; nothing of it but the tables depends on the transfer function."""
    texels, texel_format, offset, scale = _texels(volume)
    return ValueTexture(
        texels[..., np.newaxis],
        texel_format,
        offset,
        scale,
        transfer_function,
        classification,
        volume.smallest_spacing,
    )


def _texels(volume: Volume) -> tuple[NDArray, str, float, float]:
    """Values as stored, the format's name, and offset and scale that take them back to data units."""
    values = volume.values
    if values.dtype == np.uint8:
        return values.astype(np.uint16) * np.uint16(257), "r16", 0.0, 255.0
    if values.dtype == np.int8:
        return (values.astype(np.int16) + 128).astype(np.uint16) * np.uint16(257), "r16", -128.0, 255.0
    if values.dtype == np.uint16:
        return values, "r16", 0.0, 65535.0
    if values.dtype == np.int16:
        return (values.view(np.uint16) ^ np.uint16(0x8000)), "r16", -32768.0, 65535.0
    low, high = volume.finite_range or (0.0, 1.0)
    if values.dtype in (np.float16, np.float32) and max(abs(low), abs(high)) < _HUGE:
        return _without_infinities(values), "r16f" if values.dtype == np.float16 else "r32f", 0.0, 1.0
    offset, scale = low / 2 + high / 2, (high / 2 - low / 2) or 1.0
    texels = np.empty(values.shape, np.float32)
    for stored, slice_ in zip(texels, values, strict=True):  # by slices, so that no second float64 volume exists
        stored[:] = (slice_.astype(np.float64) - offset) / scale
    return _without_infinities(texels), "r32f", offset, scale


def _without_infinities(texels: NDArray) -> NDArray:
    """`texels` with finite stand-ins for infinities, which would be NaN wherever their weight is 0."""
    if not np.isinf(texels).any():
        return texels
    most = min(_HUGE, float(np.finfo(texels.dtype).max))
    return np.where(np.isinf(texels), np.copysign(texels.dtype.type(most), texels), texels)
