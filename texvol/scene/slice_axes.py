"""Slices of a volume along its grid, in the orientation of radiology.

Sagittal, coronal and axial slices are perpendicular to the grid axes that are nearest to x, y and z of the world. In
axial and coronal slices the patient's left is on the right of the picture. Anterior is up, or on the left; superior is
up. A volume of unknown space is taken as x left, y posterior, z superior, as in DICOM.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.scene.spaces import OPPOSITE, letters_of_space
from texvol.scene.volume import Volume

NAMES = ("axial", "coronal", "sagittal")
_NORMALS = {"sagittal": 0, "coronal": 1, "axial": 2}  # world axis


@dataclass(frozen=True)
class Slice:
    """Orientation of a slice.

    Attributes
    ----------
    axis : int
        Grid axis perpendicular to the slice.
    across, down : (grid axis, sign)
        Grid axes that point to the right and down in the picture; the sign is -1 for the opposite direction.
    """

    axis: int
    across: tuple[int, int]
    down: tuple[int, int]

    def values(self, volume: Volume, index: int) -> NDArray:
        """Return the samples of the slice, shape (rows, columns), top row first."""
        return self.of(volume.values, index)

    def of(self, samples: NDArray, index: int) -> NDArray:
        """Return the slice of an array of shape (nz, ny, nx), shape (rows, columns), top row first."""
        # Indexing makes a view; np.take would copy the whole volume.
        plane = np.moveaxis(samples.T, self.axis, 0)[index]  # [x, y, z] without the axis
        rest = [axis for axis in range(3) if axis != self.axis]
        if rest[0] == self.across[0]:
            plane = plane.T
        return plane[:: self.down[1], :: self.across[1]]

    def extent(self, volume: Volume) -> tuple[float, float]:
        """Return the width and the height in world units."""
        lengths = volume.spacing * np.array(volume.dimensions)
        return float(lengths[self.across[0]]), float(lengths[self.down[0]])

    def fractions(self, volume: Volume, index: NDArray[np.float64]) -> tuple[float, float]:
        """Return the position of a grid index in the picture: fractions from the left and from the top."""
        return tuple(  # type: ignore[return-value]
            float(fraction if sign > 0 else 1 - fraction)
            for axis, sign in (self.across, self.down)
            for fraction in [(index[axis] + 0.5) / volume.dimensions[axis]]
        )


def slices_of(volume: Volume) -> dict[str, Slice]:
    """Return the three slices of a volume, by name."""
    axes = _grid_axes(volume)
    words = volume.space.lower().split("-")
    left = -1 if words[0] == "right" else 1
    anterior = 1 if len(words) > 1 and words[1] == "anterior" else -1
    superior = -1 if len(words) > 2 and words[2] == "inferior" else 1
    # World axis and sign of the directions to the right and down.
    looks = {
        "axial": ((0, left), (1, -anterior)),
        "coronal": ((0, left), (2, -superior)),
        "sagittal": ((1, -anterior), (2, -superior)),
    }
    found = {}
    for name in NAMES:
        across, down = (
            (axes[world], sign * (1 if volume.direction[world, axes[world]] >= 0 else -1))
            for world, sign in looks[name]
        )
        found[name] = Slice(axes[_NORMALS[name]], across, down)
    return found


def letters_of(volume: Volume, slice_: Slice) -> tuple[str, str, str, str] | None:
    """Return the letters (L, R, A, P, S, I) at the left, right, top and bottom; None if the space is unknown."""
    space = letters_of_space(volume.space)
    if space is None:
        return None
    found: list[str] = []
    for axis, sign in (slice_.across, slice_.down):
        towards = sign * volume.direction[:, axis] / np.linalg.norm(volume.direction[:, axis])
        world = int(np.argmax(np.abs(towards)))
        ends = (OPPOSITE[space[world]], space[world])
        found += ends if towards[world] > 0 else ends[::-1]
    return found[0], found[1], found[2], found[3]


def typical_window(volume: Volume) -> tuple[float, float]:
    """Return the centre and width of a window from the 1st to the 99.5th percentile of the values."""
    step = max(1, round((volume.size / 1e5) ** (1 / 3)))
    values = volume.values[::step, ::step, ::step].astype(np.float64)
    values = values[np.isfinite(values)]
    if not values.size:
        return 0.0, 1.0
    low, high = (float(each) for each in np.percentile(values, (1, 99.5)))
    if not high > low:
        low, high = volume.finite_range or (low, high)
    return (low + high) / 2, max(high - low, 1e-6 * max(abs(high), 1.0))


def _grid_axes(volume: Volume) -> list[int]:
    """Return the nearest grid axis for each of x, y and z of the world; no grid axis is used twice."""
    alignment = np.abs(volume.direction / np.linalg.norm(volume.direction, axis=0))
    axes = [-1, -1, -1]
    for _ in range(3):
        world, grid = np.unravel_index(int(np.argmax(alignment)), (3, 3))
        axes[int(world)] = int(grid)
        alignment[world, :] = alignment[:, grid] = -1
    return axes
