"""The samples that all methods start from, relative to the isovalue and one longer on each side than the volume.

The layer around the volume repeats its outermost samples, half a spacing away from them: the field is constant in the
outer half spacings, as in every picture, and surfaces are open where they reach the box.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume

# Infinite values become so many ranges of the finite ones; the surface moves towards the finite side by this fraction.
INFINITE = 2.0**20
# Least distance of a sample from the isovalue, in ranges: no vertex falls on a sample, no triangle is without area.
_NEAREST = np.float32(2.0**-24)


class Facets(NamedTuple):
    """A surface in index space: vertices (n, 3) as x, y, z; triangles (m, 3); normals (n, 3) or None.

    Triangles are counter-clockwise seen from lower values in a right-handed index space, and normals point there.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    normals: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class Field:
    """Samples above the isovalue, as fractions of the range, shape (nz + 2, ny + 2, nx + 2).

    `missing` is a mask of that shape, or None; `above` is 1 where samples are missing.
    """

    volume: Volume
    above: NDArray[np.float32]
    missing: NDArray[np.bool_] | None

    @cached_property
    def decided(self) -> NDArray[np.float32]:
        """Samples that are all above or below: those that have the value itself are just below it."""
        sign = np.where(self.above > 0, _NEAREST, -_NEAREST)
        return np.where(np.abs(self.above) < _NEAREST, sign, self.above)

    def places(self, samples: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the positions (…, 3) of samples of `above`, given by their flat numbers: x, y, z in index space."""
        last = np.array(self.volume.dimensions) - 0.5
        indices = np.unravel_index(samples, self.above.shape)
        return np.clip(np.stack(indices[::-1], axis=-1) - 1.0, -0.5, last)

    def gradients(self, samples: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return central differences (…, 3) at samples of `above`, per step in index space: x, y, z."""
        flat = self.decided.reshape(-1)
        indices = np.unravel_index(samples, self.above.shape)
        slopes = []
        for axis, stride in ((2, 1), (1, self.above.shape[2]), (0, self.above.shape[1] * self.above.shape[2])):
            behind = samples - stride * (indices[axis] > 0)
            ahead = samples + stride * (indices[axis] < self.above.shape[axis] - 1)
            slopes.append((flat[ahead].astype(np.float64) - flat[behind]) / 2)
        return np.stack(slopes, axis=-1)

    def crossed_cells(self) -> NDArray[np.int64]:
        """Return the first corners, as flat numbers in `above`, of cells with the surface that miss no corner."""
        inside = self.decided > 0
        crossed = over_corners(np.logical_or, inside) & ~over_corners(np.logical_and, inside)
        if self.missing is not None:
            crossed &= ~over_corners(np.logical_or, self.missing)
        cells = np.stack(np.nonzero(crossed))
        return np.ravel_multi_index(tuple(cells), self.above.shape)

    def corner_steps(self) -> NDArray[np.int64]:
        """Return the flat distances (8,) from a cell's first corner; corner c has bits 0, 1, 2 along x, y, z."""
        corners = np.arange(8)
        _, ny, nx = self.above.shape
        return (corners & 1) + nx * (corners >> 1 & 1) + nx * ny * (corners >> 2)


def over_corners(operation: np.ufunc, samples: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return `operation` over the eight corners of each cell."""
    found = operation(samples[1:], samples[:-1])
    found = operation(found[:, 1:], found[:, :-1])
    return np.asarray(operation(found[..., 1:], found[..., :-1]))


def field_of(volume: Volume, value: float) -> Field:
    """Return the field of a volume, relative to a value within its range."""
    low, high = volume.finite_range or (value, value)
    scale = max(high - value, value - low) or 1.0
    above = np.empty(volume.shape, np.float32)
    for layer, slot in zip(volume.values, above, strict=True):  # by layers: no float64 of all at once
        slot[...] = np.clip((layer.astype(np.float64) - value) / scale, -INFINITE, INFINITE)
    missing = np.isnan(above)
    above[missing] = 1.0  # cells beside them are left out
    return Field(volume, np.pad(above, 1, mode="edge"), np.pad(missing, 1, mode="edge") if missing.any() else None)
