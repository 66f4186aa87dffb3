"""VTR: VTK's rectilinear grid, three axes of coordinates in XML."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.rectilinear import axis_between, axis_of, on_axes
from texvol.formats.readers.samples import Choice, FileFault, Samples
from texvol.formats.readers.vtk_xml import Grid, extent_of, read_whole


def read(path: str, choice: Choice) -> Samples:
    """Return the samples at the points of a grid, or at the middles of its cells if only these have values."""
    grid, samples = read_whole(path, "RectilinearGrid", choice)
    placed = axis_of if grid.at_points else axis_between
    axes = [placed(_coordinates(grid, axis), "xyz"[axis]) for axis in range(3)]
    return on_axes(samples.values, axes, choice)._replace(notes=samples.notes)


def _coordinates(grid: Grid, axis: int) -> NDArray:
    """Return the coordinates of the points along an axis, assembled from all pieces."""
    name = "xyz"[axis]
    begin, end = grid.extent[2 * axis : 2 * axis + 2]
    found, seen = np.empty(0), np.zeros(end - begin + 1, np.bool_)
    for piece in grid.pieces:
        first, last = extent_of(piece.get("Extent"))[2 * axis : 2 * axis + 2]
        arrays = piece.findall("Coordinates/DataArray")
        if len(arrays) != 3:
            raise FileFault(f"its piece of extent {piece.get('Extent')} has {len(arrays)} arrays of coordinates, not 3")
        part = grid.document.array(arrays[axis], [last - first + 1, 1], f"coordinates {name}")[:, 0]
        found = found if found.size else np.zeros(end - begin + 1, part.dtype)
        where = slice(first - begin, last - begin + 1)
        if not np.array_equal(found[where][seen[where]], part[seen[where]]):
            raise FileFault(f"the coordinates {name} of its pieces contradict each other")
        found[where], seen[where] = part, True
    return found  # complete, as the samples are
