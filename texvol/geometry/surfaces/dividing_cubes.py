"""Dividing cubes (Cline, Lorensen, Ludke, Crawford, Teeter 1988): crossed cells are divided until they are points.

A cell that the surface crosses is divided evenly into parts no longer than a given size, with the trilinear field at
their corners. A part that the surface crosses becomes a point in its middle, with the interpolated gradient as normal.
A point is off the surface by half the diagonal of a part at most: order 1 in the size.
"""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from texvol.geometry.surfaces.field import Field
from texvol.util.errors import InputError, is_number

_ROUNDING = 1e-12  # of a quotient: a size of a third of the spacing makes three parts
_AT_ONCE = 2**21  # parts of cells, in memory at a time
_MOST, _MOST_OF_CELL = 2**30, 2**24  # parts altogether: minutes; parts of a cell: half a gigabyte


def checked_size(field: Field, size: float | None) -> float:
    """Return the largest side of a part, world units: half the smallest spacing where it is None.

    Raises
    ------
    InputError
        If it is not a finite number above 0.
    """
    if size is None:
        return field.volume.smallest_spacing / 2
    if not (is_number(size) and 0 < size < np.inf):
        raise InputError(f"cell_size must be a finite number above 0, got {size!r}")
    return float(size)


def dividing_cubes(field: Field, size: float | None = None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points and normals (n, 3) in index space, x, y, z; normals point to lower values, of any length.

    Raises
    ------
    InputError
        If `size` is no number above 0, or makes too many parts.
    """
    size = checked_size(field, size)
    cells = field.crossed_cells()
    each = np.ceil(np.minimum(field.volume.spacing / size, _MOST) * (1 - _ROUNDING)).astype(int)  # parts along x, y, z
    of_cell = each.astype(np.float64).prod()
    if of_cell > _MOST_OF_CELL or len(cells) * of_cell > _MOST:
        raise InputError(
            f"cell_size must make at most {_MOST_OF_CELL:.3g} parts of a cell and {_MOST:.3g} in all, "
            f"got {of_cell:.3g} and {len(cells) * of_cell:.3g}"
        )
    chunks = max(1, ceil(len(cells) * of_cell / _AT_ONCE))
    found = [_points(field, chunk, each) for chunk in np.array_split(cells, chunks)]
    points, normals = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return points, normals


def _points(
    field: Field, cells: NDArray[np.int64], each: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points and normals of some cells, divided into `each` parts along x, y, z."""
    corners = cells[:, np.newaxis] + field.corner_steps()
    values = field.decided.reshape(-1)[corners].astype(np.float64).reshape(-1, 2, 2, 2)
    # Trilinear values at the corners of the parts, axis by axis: z, y, x.
    for axis, count in zip((1, 2, 3), each[::-1], strict=True):
        fraction = np.linspace(0, 1, count + 1).reshape([-1 if other == axis else 1 for other in range(4)])
        low, high = np.split(values, 2, axis=axis)
        values = low + fraction * (high - low)
    inside = values > 0
    any_inside, all_inside = inside, inside
    for axis in (1, 2, 3):
        ahead = tuple(slice(1, None) if other == axis else slice(None) for other in range(4))
        behind = tuple(slice(None, -1) if other == axis else slice(None) for other in range(4))
        any_inside = any_inside[ahead] | any_inside[behind]
        all_inside = all_inside[ahead] & all_inside[behind]
    cell, *part = np.nonzero(any_inside & ~all_inside)
    middle = (np.stack(part[::-1], axis=1) + 0.5) / each
    first, last = field.places(corners[cell, 0]), field.places(corners[cell, 7])
    bits = (np.arange(8)[:, np.newaxis] >> np.arange(3)) & 1
    weights = np.where(bits == 1, middle[:, np.newaxis], 1 - middle[:, np.newaxis]).prod(axis=2)
    slopes = np.einsum("nc,nca->na", weights, field.gradients(corners)[cell])
    return first + middle * (last - first), -slopes
