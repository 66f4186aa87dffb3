"""Cells between samples, front to back, and the path of a ray through one: the ground of methods that go by cells.

Cell (i, j, k) reaches from sample i - 1 to sample i along x, likewise along y and z. The first and the last cell of an
axis reach half a spacing beyond the outermost sample only, to the end of the box; a box of n samples has n + 1 cells.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.methods.grid_view import GridView
from texvol.ray_casting.common.compiling import compiled

# Cached functions that call those below close over this: numba itself watches only the file of the caller.
SOURCE = Path(__file__).read_text(encoding="utf-8")


def any_corner(padded: NDArray[Any], of_two: Callable[[NDArray[Any], NDArray[Any]], NDArray[Any]]) -> NDArray[Any]:
    """Reduce the eight corners of each cell, from samples that are padded by one, to shape (nz + 1, ny + 1, nx + 1).

    Parameters
    ----------
    of_two : callable
        Reduces two arrays to one, such as `np.minimum`.
    """
    for axis in range(3):
        count = padded.shape[axis]
        padded = of_two(padded.take(range(count - 1), axis), padded.take(range(1, count), axis))
    return padded


def cell_order(view: GridView) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the cell nearest to the eye and the steps away from it, x, y and z.

    Along a parallel ray the index of each axis only rises or only falls, so any nesting of the three loops will do.
    """
    forward = np.where(view.step < 0, -1, 1)
    last = np.rint(2 * view.middle).astype(np.int64) + 1
    return np.where(forward > 0, 0, last), forward


@compiled
def _ends(i, cells):  # type: ignore[no-untyped-def]
    """Indices at which a cell begins and ends along an axis."""
    return max(i - 1.0, -0.5), min(float(i), cells - 1.5)


@compiled
def pixels_below(i, j, k, cells, start, to_picture, shape):  # type: ignore[no-untyped-def]
    """First row, end of rows, first column and end of columns of the rectangle around a projected cell."""
    x0, x1 = _ends(i, cells[2])
    y0, y1 = _ends(j, cells[1])
    z0, z1 = _ends(k, cells[0])
    x, y, z = (x0 + x1) / 2 - start[0], (y0 + y1) / 2 - start[1], (z0 + z1) / 2 - start[2]
    column = to_picture[0, 0] * x + to_picture[0, 1] * y + to_picture[0, 2] * z
    row = to_picture[1, 0] * x + to_picture[1, 1] * y + to_picture[1, 2] * z
    across, below = np.abs(to_picture[0]), np.abs(to_picture[1])
    # A pixel in the edge of the rectangle must not be lost to rounding.
    half_width = (across[0] * (x1 - x0) + across[1] * (y1 - y0) + across[2] * (z1 - z0)) / 2 + 1e-6
    half_height = (below[0] * (x1 - x0) + below[1] * (y1 - y0) + below[2] * (z1 - z0)) / 2 + 1e-6
    top, bottom = max(int(np.ceil(row - half_height)), 0), min(int(np.floor(row + half_height)) + 1, shape[0])
    left, right = max(int(np.ceil(column - half_width)), 0), min(int(np.floor(column + half_width)) + 1, shape[1])
    return top, bottom, left, right


@compiled
def _cut(x, slope, i, cells, s, s_end):  # type: ignore[no-untyped-def]
    """Part of a ray, from s to s_end, inside a cell along one axis."""
    low, high = _ends(i, cells)
    if slope == 0:  # a ray in the face between two cells belongs to the second
        return s, s_end if low <= x < high else s
    a, b = (low - x) / slope, (high - x) / slope
    return max(s, min(a, b)), min(s_end, max(a, b))


@compiled
def path_in_cell(i, j, k, cells, x, y, z, step, near):  # type: ignore[no-untyped-def]
    """Distances at which a ray from (x, y, z) enters and leaves a cell; the second is not larger if it misses it."""
    s, s_end = _cut(x, step[0], i, cells[2], near, np.inf)
    s, s_end = _cut(y, step[1], j, cells[1], s, s_end)
    return _cut(z, step[2], k, cells[0], s, s_end)


@compiled
def shows_through(pixel, q0, q1, q2, tau, path):  # type: ignore[no-untyped-def]
    """Composite a path through a constant medium behind a pixel (section 6.3: C = E L (1 - e^(-τL)) / (τL))."""
    opacity = -np.expm1(-tau * path)
    left = 1 - pixel[3]
    weight = left * (opacity / tau if tau > 0 else path)
    pixel[0] += weight * q0
    pixel[1] += weight * q1
    pixel[2] += weight * q2
    pixel[3] += left * opacity
