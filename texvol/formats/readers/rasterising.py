"""Fields on tetrahedra sampled at the points of a regular grid along the world's axes.

Each tetrahedron takes those columns of the regular grid, along x, that its bounding box meets. On a column, its
barycentric coordinates are linear in x, so the samples inside are those of one interval, and their values are linear
too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.resampling import Floats
from texvol.scene.tetrahedra import TetrahedralGrid, barycentric_maps

_CELLS = 2**15  # tetrahedra per step
_COLUMNS = 2**17  # columns of a step, and samples: intermediates stay in the cache
# Of a tetrahedron: samples this far outside count as on the face, so that none is lost between two, nor on the border.
_EDGE = 1e-9


def rasterise(grid: TetrahedralGrid, spacing: Floats, counts: Sequence[int], made: NDArray) -> int:
    """Write the field's samples to `made`; return the number of samples outside of all tetrahedra, which stay.

    Parameters
    ----------
    grid : TetrahedralGrid
        Tetrahedra with a value that is not finite are missing. A sample on a face has the last tetrahedron's value.
    spacing : array of shape (3,)
        Distance of the samples from the low corner of the grid's box, along x, y and z.
    counts : (nx, ny, nz)
    made : array of shape (nx · ny · nz,)
        Samples along x, then y, then z.
    """
    inside = np.zeros(made.size, np.bool_)
    whole = np.flatnonzero(grid.is_whole)
    for begin in range(0, len(whole), _CELLS):
        which = whole[begin : begin + _CELLS]
        values = grid.values[which] if grid.per_cell else None
        for tetrahedron, first, sizes, line in _intervals(grid, which, spacing, counts):
            for some in _bounded(sizes):
                number = np.repeat(np.arange(some.start, some.stop), sizes[some])
                x = np.arange(len(number)) - np.repeat(_starts(sizes[some]), sizes[some])
                at = first[number] + x
                inside[at] = True
                if values is not None:
                    made[at] = values[tetrahedron[number]]
                else:
                    made[at] = line[number, 0] + line[number, 1] * x
    return int(made.size - inside.sum())


def _intervals(
    grid: TetrahedralGrid, which: NDArray[np.intp], spacing: Floats, counts: Sequence[int]
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], Floats]]:
    """Yield samples in a row inside tetrahedra: tetrahedron, first sample, number of samples, first value and step."""
    corners = grid.corners(which) / spacing
    low = np.clip(np.ceil(corners.min(axis=1) - _EDGE), 0, counts).astype(np.intp)
    high = np.clip(np.floor(corners.max(axis=1) + _EDGE), -1, np.array(counts) - 1).astype(np.intp)
    sizes = np.maximum(high - low + 1, 0)
    weights, field = _on_columns(corners, low, grid.corner_values(which))
    columns = np.where(sizes[:, 0] > 0, sizes[:, 1] * sizes[:, 2], 0)
    for some in _bounded(columns):
        cell = np.repeat(np.arange(some.start, some.stop), columns[some])
        within = np.arange(len(cell)) - np.repeat(_starts(columns[some]), columns[some])
        z, y = np.divmod(within, sizes[cell, 1])
        slopes = weights[1][:, cell]
        offsets = weights[0][:, cell] + weights[2][:, cell] * y + weights[3][:, cell] * z
        begin, end = _between(offsets, slopes, sizes[cell, 0])
        met = np.flatnonzero(end >= begin)
        cell, begin, end, y, z = cell[met], begin[met], end[met], y[met], z[met]
        start, slope = field[0, cell] + field[2, cell] * y + field[3, cell] * z, field[1, cell]
        first = low[cell, 0] + begin + counts[0] * (low[cell, 1] + y + counts[1] * (low[cell, 2] + z))
        yield cell, first, end - begin + 1, np.stack([start + slope * begin, slope], axis=1)


def _on_columns(corners: Floats, low: NDArray[np.intp], values: Floats) -> tuple[list[Floats], Floats]:
    """Return barycentric coordinates and the field at the samples `low`, and their steps along x, y and z.

    Returns
    -------
    list of four arrays of shape (4, m)
        The coordinates, then their steps.
    array of shape (4, m)
        The field, then its steps.
    """
    gradients, constants = barycentric_maps(corners)
    steps = [np.ascontiguousarray(gradients[:, :, axis].T) for axis in range(3)]
    away = (low - corners[:, 0]).T
    first = constants.T + steps[0] * away[0] + steps[1] * away[1] + steps[2] * away[2]
    # The sum of the weights is 1. Counted from the first corner, equal values stay equal to the last digit.
    rises = (values - values[:, :1]).T
    field = np.stack([(rises * part).sum(axis=0) for part in (first, *steps)])
    field[0] += values[:, 0]
    return [first, *steps], field


def _between(offsets: Floats, slopes: Floats, sizes: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return first and last of the samples 0 … size - 1 where no weight, offset + slope · sample, is negative.

    Parameters
    ----------
    offsets, slopes : arrays of shape (4, m)
    sizes : array of shape (m,)
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        met = -(offsets + _EDGE) / slopes
    never = np.where((slopes == 0) & (offsets < -_EDGE), np.inf, -np.inf)
    after, before = np.where(slopes > 0, met, never), np.where(slopes < 0, met, np.inf)
    # Pair by pair: numpy takes ten times as long to reduce a short axis.
    begin = np.maximum(np.maximum(after[0], after[1]), np.maximum(after[2], after[3]))
    end = np.minimum(np.minimum(before[0], before[1]), np.minimum(before[2], before[3]))
    # A sample within 1e-9 of the interval belongs to it.
    first = np.clip(np.ceil(begin - _EDGE), 0, sizes)
    last = np.clip(np.floor(end + _EDGE), -1, sizes - 1)
    return first.astype(np.intp), last.astype(np.intp)


def _starts(sizes: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the sums of the sizes before each."""
    return np.cumsum(sizes) - sizes


def _bounded(sizes: NDArray[np.intp]) -> Iterator[slice]:
    """Yield consecutive slices whose sizes add up to about _COLUMNS at most, or that hold one size."""
    ends = np.cumsum(sizes)
    begin = 0
    while begin < len(sizes):
        before = int(ends[begin - 1]) if begin else 0
        end = max(int(np.searchsorted(ends, before + _COLUMNS, side="right")), begin + 1)
        yield slice(begin, end)
        begin = end
