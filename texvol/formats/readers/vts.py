"""VTS: VTK's structured grid, with a world position for each sample, in XML."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.curvilinear import on_points
from texvol.formats.readers.samples import Choice, FileFault, Samples, by, check_size
from texvol.formats.readers.vtk_xml import Whole, extent_of, read_whole, sizes_of


def read(path: str, choice: Choice) -> Samples:
    """Return the samples at the points of a grid, or at the middles of its cells if only these have values."""
    whole = read_whole(path, "StructuredGrid", choice)
    points = _points(whole)
    if not whole.at_points:
        points = _middles(points)
    return on_points(whole.values, points, choice)._replace(notes=whole.notes)


def _points(whole: Whole) -> NDArray:
    """Return the points, shape (nz, ny, nx, 3), assembled from all pieces."""
    sizes = [*sizes_of(whole.extent, at_points=True), 3]
    values = covered = None
    for piece in whole.pieces:
        extent = extent_of(piece.get("Extent"))
        part_sizes = [*sizes_of(extent, at_points=True), 3]
        part = whole.array(piece, piece.find("Points/DataArray"), part_sizes, "points")
        if part_sizes == sizes:
            return part
        if values is None or covered is None:
            check_size(sizes, part.dtype.itemsize)
            values, covered = np.empty(sizes, part.dtype), np.zeros(sizes[:3], np.bool_)
        begin = [extent[2 * axis] - whole.extent[2 * axis] for axis in (2, 1, 0)]
        where = tuple(slice(at, at + size) for at, size in zip(begin, part_sizes[:3], strict=True))
        values[where], covered[where] = part, True
    if values is None or covered is None or not covered.all():
        raise FileFault(f"the points of its pieces do not cover its extent of {by(sizes[2::-1])}")
    return values


def _middles(points: NDArray) -> NDArray:
    """Return the middles of the cells, the means of their corners."""
    for axis in range(3):
        ends = np.split(points, [1], axis=axis)[1], np.delete(points, -1, axis=axis)
        points = (ends[0] + ends[1]) / 2
    return points
