"""Cutting: half spaces and a box outside of which nothing is seen.

A clip plane (n, d) keeps n·x ≥ d, in world units; n has any length but 0, and d is in its units. A crop box keeps what
lies between its planes along x, y and z of the world. What is kept is the intersection of all: along a ray it is one
interval [s0, s1], so that cutting is exact for every ray, whatever the slabs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.volume import Volume
from texvol.util.errors import InputError

Range = tuple[float, float]


@dataclass(frozen=True)
class ClipPlane:
    """Half space normal · x ≥ offset; only the part of the volume inside it shows.

    Raises
    ------
    InputError
        If the normal is not three finite numbers of which one is not 0, or the offset not finite.
    """

    normal: tuple[float, float, float]
    offset: float

    if TYPE_CHECKING:  # what may be given, beside what is kept

        def __init__(self, normal: ArrayLike, offset: float) -> None: ...

    def __post_init__(self) -> None:
        normal = np.asarray(self.normal, np.float64)
        if normal.shape != (3,) or not np.isfinite(normal).all():
            raise InputError(f"clip plane: normal must be three finite numbers, got {self.normal!r}")
        if not np.abs(normal).max() > 0:
            raise InputError("clip plane: normal must not be 0, 0, 0")
        if not np.isfinite(self.offset):
            raise InputError(f"clip plane: offset must be a finite number, got {self.offset!r}")
        object.__setattr__(self, "normal", tuple(normal.tolist()))


def checked_crop(crop: Sequence[Sequence[float]] | NDArray[Any]) -> tuple[Range, Range, Range]:
    """Return ((x0, x1), (y0, y1), (z0, z1)), whose ends may be infinite; InputError if a range is empty."""
    try:
        ranges = np.asarray(crop, np.float64)
    except (TypeError, ValueError):
        ranges = np.empty(0)
    if ranges.shape != (3, 2) or np.isnan(ranges).any():
        raise InputError(f"crop box must be ((x0, x1), (y0, y1), (z0, z1)), got {crop!r}")
    for name, (low, high) in zip("xyz", ranges, strict=True):
        if not low < high:
            raise InputError(f"crop box: {name} must go from less to more, got {low:g} to {high:g}")
    x, y, z = ((float(low), float(high)) for low, high in ranges)
    return x, y, z


@dataclass(frozen=True)
class Cutting:
    """Clip planes and a crop box together, as half spaces; with `caps` the medium is opaque where they cut it open."""

    planes: tuple[ClipPlane, ...] = ()
    crop: tuple[Range, Range, Range] | None = None
    caps: bool = False

    def __len__(self) -> int:
        return len(self.planes) + int(np.isfinite(np.array(self.crop or ())).sum())

    def half_spaces(self, volume: Volume) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Unit normals (planes, 3) and distances (planes): what is kept has normal · (x - centre) ≥ distance."""
        normals, offsets = [], []
        for plane in self.planes:
            normal = np.asarray(plane.normal, np.float64)
            length = float(np.linalg.norm(normal / np.abs(normal).max()) * np.abs(normal).max())
            normals.append(normal / length)
            offsets.append(plane.offset / length)
        for axis, (low, high) in enumerate(self.crop or ()):
            for sign, end in ((1.0, low), (-1.0, high)):
                if np.isfinite(end):
                    normals.append(sign * np.eye(3)[axis])
                    offsets.append(sign * end)
        all_normals = np.array(normals, np.float64).reshape(-1, 3)
        return all_normals, np.array(offsets, np.float64) - all_normals @ volume.centre

    def interval(
        self, volume: Volume, nearest: NDArray[np.float64], directions: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The s between which rays are kept; s0 > s1 where nothing of them is.

        Parameters
        ----------
        nearest, directions : arrays of shape (…, 3)
            Rays are centre + nearest + s directions, in world units.
        """
        first = np.full(nearest.shape[:-1], -np.inf)
        last = np.full(nearest.shape[:-1], np.inf)
        for normal, distance in zip(*self.half_spaces(volume), strict=True):
            # Not as a product of matrices, whose rounding depends on the number of rays.
            height, rise = (nearest * normal).sum(axis=-1) - distance, (directions * normal).sum(axis=-1)
            with np.errstate(divide="ignore", invalid="ignore"):
                meets = -height / rise
            first = np.where(rise > 0, np.maximum(first, meets), first)
            last = np.where(rise < 0, np.minimum(last, meets), last)
            last = np.where((rise == 0) & (height < 0), -np.inf, last)
        return first, last


NOT_CUT = Cutting()
