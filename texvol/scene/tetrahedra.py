"""Tetrahedral grids: points anywhere, tetrahedra between them, and a field that is linear or constant in each.

In a tetrahedron with corners p_0 … p_3 every point is p = Σ b_i p_i with Σ b_i = 1; the weights b_i are the barycentric
coordinates of p, linear in p, and all of them are between 0 and 1 inside. The field is f(p) = Σ b_i f_i.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.util.errors import InputError
from texvol.util.kept_arrays import read_only

# Six volumes of a tetrahedron in a box of edges 1, below which it is flat: some thousand roundings of float64.
_FLAT = 1e-12
_FARTHEST = 1e90  # of a coordinate: its cube is a number


class TetrahedralGrid:
    """Field on tetrahedra: linear between values at the points, or one value in each tetrahedron.

    Parameters
    ----------
    points : array of shape (n, 3)
        World positions.
    tetrahedra : array of shape (m, 4)
        Numbers of the corners among the points, in any order. A tetrahedron without volume is left out; so is one with
        a value that is not finite, which is missing.
    values : array of shape (n,) or (m,)
        Values at the points, or with `per_cell` those of the tetrahedra.
    per_cell : bool
        True if each tetrahedron has one value.

    Raises
    ------
    InputError
        If a shape or type is wrong, a corner is no point, a point is not finite, or no tetrahedron has a volume.
    """

    def __init__(self, points: ArrayLike, tetrahedra: ArrayLike, values: ArrayLike, *, per_cell: bool = False) -> None:
        places, corners, field = np.asarray(points), np.asarray(tetrahedra), np.asarray(values)
        if places.ndim != 2 or places.shape[1] != 3 or places.dtype.kind not in "iuf":
            raise InputError(f"points must be numbers of shape (n, 3), got {places.dtype} of {places.shape}")
        if corners.ndim != 2 or corners.shape[1] != 4 or corners.dtype.kind not in "iu" or not corners.size:
            raise InputError(
                f"tetrahedra must be whole numbers of shape (m, 4), got {corners.dtype} of {corners.shape}"
            )
        wanted = len(corners) if per_cell else len(places)
        if field.shape != (wanted,) or field.dtype.kind not in "iuf":
            raise InputError(f"values must be {wanted} real numbers, got {field.dtype} of {field.shape}")
        if corners.min() < 0 or corners.max() >= len(places):
            wrong = int(corners.min()) if corners.min() < 0 else int(corners.max())
            raise InputError(f"tetrahedra must name points 0 to {len(places) - 1}, got {wrong}")
        self.points = read_only(places.astype(np.float64))
        used = self.points[np.unique(corners)]
        if not (np.abs(used) <= _FARTHEST).all():  # NaN is not
            raise InputError(f"points must be finite and at most {_FARTHEST:g} from 0 along each axis")
        self.low, self.high = read_only(used.min(axis=0)), read_only(used.max(axis=0))
        has_volume = _volumes(self.points, corners, self.high - self.low) > _FLAT
        self.flat = int((~has_volume).sum())
        if self.flat == len(corners):
            raise InputError(f"tetrahedra must have a volume, got {self.flat} flat ones")
        self.tetrahedra = read_only(corners[has_volume].astype(np.intp))
        self.values = read_only((field[has_volume] if per_cell else field).copy())
        self.per_cell = bool(per_cell)

    @property
    def count(self) -> int:
        """Number of tetrahedra."""
        return len(self.tetrahedra)

    @property
    def extent(self) -> NDArray[np.float64]:
        """Edges x, y, z of the bounding box."""
        return self.high - self.low

    @cached_property
    def is_whole(self) -> NDArray[np.bool_]:
        """True for each tetrahedron whose values are finite, shape (m,)."""
        finite = np.isfinite(self.values)
        return read_only(finite if self.per_cell else finite[self.tetrahedra].all(axis=1))

    def corners(self, which: NDArray[np.intp] | slice) -> NDArray[np.float64]:
        """Return the corners of some tetrahedra from the low corner of the box, shape (m, 4, 3)."""
        found: NDArray[np.float64] = self.points[self.tetrahedra[which]] - self.low
        return found

    def corner_values(self, which: NDArray[np.intp] | slice) -> NDArray[np.float64]:
        """Return the values at the corners of some tetrahedra, shape (m, 4)."""
        if self.per_cell:
            own = self.values[which].astype(np.float64)
            return np.repeat(own[:, np.newaxis], 4, axis=1)
        found: NDArray[np.float64] = self.values[self.tetrahedra[which]].astype(np.float64)
        return found


def _volumes(points: NDArray[np.float64], corners: NDArray, extent: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return six volumes of tetrahedra, relative to the cube of the longest of their edges, all positive.

    Lengths are fractions of the box, since its axes may have different units.
    """
    scale = np.where(extent > 0, extent, 1.0)
    first = points[corners[:, 0]]
    edges = [(points[corners[:, number]] - first) / scale for number in (1, 2, 3)]
    longest = np.max([np.abs(edge).max(axis=1) for edge in edges], axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        volumes = np.abs((np.cross(edges[0], edges[1]) * edges[2]).sum(axis=1)) / longest**3
    return np.nan_to_num(volumes)


def barycentric_maps(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return gradients, shape (m, 4, 3), and constants, shape (m, 4), of the barycentric coordinates.

    Coordinate i of the point p is gradient_i · (p - p_0) + constant_i, with p_0 the first corner.

    Parameters
    ----------
    corners : array of shape (m, 4, 3)
    """
    a, b, c = (corners[:, number] - corners[:, 0] for number in (1, 2, 3))
    across = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    six_volumes = (a * across[:, 0]).sum(axis=1)
    gradients = np.empty_like(corners)
    gradients[:, 1:] = across / six_volumes[:, np.newaxis, np.newaxis]
    gradients[:, 0] = -gradients[:, 1:].sum(axis=1)
    constants = np.zeros(corners.shape[:2])
    constants[:, 0] = 1.0
    return gradients, constants
