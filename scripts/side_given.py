"""Scene as the programs beside texvol are given it, and its parts in the forms that they take.

Lengths are in smallest spacings, along the axes of the grid, from the corner of the box. It needs numpy alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


@dataclass(frozen=True)
class Medium:
    """A transfer function as a table of evenly spaced values from `low` to `high`."""

    low: float
    high: float
    colors: Array  # (entries, 3), linear, straight
    extinctions: Array  # (entries,), per smallest spacing

    @classmethod
    def of(cls, told: dict[str, Any]) -> Medium:
        """Return the medium that a request tells of."""
        table = np.array(told["table"])
        return cls(told["low"], told["high"], table[:, :3], table[:, 3])

    def opacities(self, distance: float) -> Array:
        """Return the opacity of a path of this length for each entry."""
        return -np.expm1(-self.extinctions * distance)

    @property
    def emission(self) -> Array:
        """Light per smallest spacing, shape (entries, 3)."""
        return self.colors * self.extinctions[:, np.newaxis]

    def per(self, length: float) -> list[Array]:
        """Return emission of three channels, and extinction, per so many smallest spacings."""
        return [*(self.emission.T * length), self.extinctions * length]

    def from_one(self, values: Array) -> tuple[Array, Medium]:
        """Return values and medium with the lowest value of the table at 1: for programs that draw nothing at 0."""
        by = 1 - self.low
        return values + by, Medium(1.0, self.high + by, self.colors, self.extinctions)

    @property
    def path_for_bits(self) -> float:
        """Path length over which opacities of few bits tell extinctions best: two mean free paths of the densest entry.

        An opacity that is off by e is an extinction that is off by e exp(τ d) / d: small for all τ where τ d is about
        1 to 2 for the largest.
        """
        most = float(self.extinctions.max())
        return 2 / most if most > 0 else 1.0

    def widened(self, entries: int = 1) -> Medium:
        """Return the medium with its outermost entries repeated: for programs that draw nothing at their bounds."""
        step = (self.high - self.low) / (len(self.extinctions) - 1) * entries
        wide = ((entries, entries), (0, 0))
        colors, extinctions = np.pad(self.colors, wide, mode="edge"), np.pad(self.extinctions, entries, mode="edge")
        return Medium(self.low - step, self.high + step, colors, extinctions)


@dataclass(frozen=True)
class Given:
    """Volume and view."""

    values: NDArray[np.float32]  # (z, y, x)
    rays: Array  # origins and unit directions of the pixels, (2, height, width, 3)
    size: tuple[int, int]
    spacing: Array
    camera: dict[str, Any]
    clip_from_box: Array  # (4, 4), for columns

    @classmethod
    def of(cls, folder: Path, told: dict[str, Any]) -> Given:
        """Return what is in the folder."""
        values, rays = np.load(folder / "values.npy"), np.load(folder / "rays.npy")
        clip = np.array(told["clip_from_box"])
        return cls(values, rays, tuple(told["size"]), np.array(told["spacing"]), told["camera"], clip)

    @property
    def box(self) -> Array:
        """The corner of the box that is farthest from 0: half a voxel beyond the outermost samples, as 0 is."""
        return np.array(self.values.shape[::-1]) * self.spacing

    def spans(self) -> tuple[Array, Array]:
        """Return distances from the rays' origins at which they enter and leave the box; equal where they miss it."""
        origins, directions = self.rays
        with np.errstate(divide="ignore", invalid="ignore"):
            planes = np.stack([-origins, self.box - origins]) / directions
        near = np.nanmax(np.min(planes, axis=0), axis=-1).clip(min=0)
        far = np.nanmin(np.max(planes, axis=0), axis=-1)
        return near, np.maximum(near, far)


def premultiplied(straight: Array) -> NDArray[np.float32]:
    """Return a picture of straight colours with its colours multiplied by its opacity."""
    picture = np.array(straight, np.float32)
    picture[..., :3] *= picture[..., 3:]
    return picture


def pixels_from_voxels(clip_from_box: Array, spacing: Array, size: tuple[int, int]) -> Array:
    """Return the matrix (4, 4), for columns, from vispy's voxels, whose centres are whole numbers, to its pixels.

    Pixels count from the top left; their depth is that of clip coordinates.
    """
    width, height = size
    box_from_voxels = np.diag([*spacing, 1.0])
    box_from_voxels[:3, 3] = spacing / 2
    pixels_from_clip = np.diag([width / 2, -height / 2, 1.0, 1.0])
    pixels_from_clip[:2, 3] = width / 2, height / 2
    matrix: Array = pixels_from_clip @ clip_from_box @ box_from_voxels
    return matrix


def voxels_per_length(directions: Array, spacing: Array) -> float:
    """Return how many voxels vispy counts on a length of 1.

    Raises
    ------
    ValueError
        If rays differ in it: its steps are as long in voxels for each ray, and one table of opacities serves all.
    """
    found = np.linalg.norm(directions / spacing, axis=-1)
    if np.ptp(found) > 1e-6 * found.max():
        raise ValueError("vispy's steps are equal in voxels, not in length, where spacings differ and rays diverge")
    return float(found.mean())
