"""Curvilinear grids, with a world position for each sample; a straight and even grid stays as it is.

Other grids are resampled on a regular grid along the world's axes, over the bounding box. Points in no cell are NaN.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.cells import Cells
from texvol.formats.readers.rectilinear import check_resolution, chosen_by, rounding_of, tolerance
from texvol.formats.readers.resampling import Difference, Floats, labels_at, resolution_for, sampled_at, type_between
from texvol.formats.readers.samples import Choice, FileFault, Samples, by, check_size, grid_from_columns, once

_CHUNK = 2**18  # samples per step

# An even grid is a combination of four corners with weights whose absolute values add up to 5, each wrong by half a
# step of the type; the point itself is wrong by another half.
_ROUNDINGS = 3


def on_points(values: NDArray, points: NDArray, choice: Choice) -> Samples:
    """Return samples on a regular grid of a field on a curvilinear grid.

    Parameters
    ----------
    values : array of shape (nz, ny, nx)
    points : array of shape (nz, ny, nx, 3)
        World positions of the samples.
    choice : Choice
        `resolution` (mx, my, mz) along the world's axes; without it an even grid stays as it is.
    """
    regular = once(choice, "regular", lambda: _checked(points, choice.resolution))
    if regular is not None:
        return Samples(values, **regular)
    position = once(choice, "place", lambda: _Position(points, choice.resolution))
    made = position.resampled(values, choice)
    lost = _lost(values, points, made, position, choice.labels)
    about: dict[str, Any] = {"grid": "curvilinear", "samples": list(values.shape[::-1]), "dimensions": position.counts}
    about |= {"chosen_by": chosen_by(choice.resolution), **lost}
    about |= {"outside": position.outside, "flat_cells": position.flat_cells}
    return Samples(made, position.spacing.tolist(), position.origin.tolist(), resampling=about)


def middles(points: NDArray) -> NDArray:
    """Return the middles of the cells between points, shape (nz, ny, nx, 3), the means of their corners."""
    for axis in range(3):
        if points.shape[axis] > 1:
            ends = np.split(points, [1], axis=axis)[1], np.delete(points, -1, axis=axis)
            points = (ends[0] + ends[1]) / 2
    return points


def _lost(values: NDArray, points: NDArray, made: NDArray, position: _Position, labels: bool) -> dict[str, Any]:
    """Return the error of the regular grid at the source's samples, or the number of changed labels."""
    difference, changed = Difference(), 0
    flat_values, flat_points = values.reshape(-1), points.reshape(-1, 3)
    for begin in range(0, flat_values.size, _CHUNK):
        part = slice(begin, begin + _CHUNK)
        index = (flat_points[part] - position.origin) / position.spacing
        if labels:
            changed += int((labels_at(made, index) != flat_values[part]).sum())
        else:
            difference.add(flat_values[part], sampled_at(made, index))
    return {"changed": changed, "compared": flat_values.size} if labels else difference.metadata()


def _checked(points: NDArray, resolution: Sequence[int] | None) -> dict[str, Any] | None:
    """Return spacing, origin and direction of a regular grid, or None if the points must be resampled."""
    if not np.isfinite(points).all():
        at = np.argwhere(~np.isfinite(points).all(axis=-1))[0][::-1]
        raise FileFault(f"its point ({by(at).replace(' x ', ', ')}) is not finite: {points[tuple(at[::-1])].tolist()}")
    if float(np.abs(points).max()) > 1e90:
        raise FileFault("its points must have coordinates of at most 1e90")
    regular = _regular(points)
    if regular is not None and resolution is None:
        return regular
    if min(points.shape[:3]) == 1:
        sizes = by(points.shape[2::-1])
        raise FileFault(f"must have two or more layers of points, got {sizes}")
    return None


def _regular(points: NDArray) -> dict[str, Any] | None:
    """Return spacing, origin and direction if the points are even along straight lines, to rounding; else None."""
    sizes = points.shape[2::-1]
    first = points[0, 0, 0].astype(np.float64)
    ends = [points[0, 0, -1], points[0, -1, 0], points[-1, 0, 0]]
    columns = [(end.astype(np.float64) - first) / max(size - 1, 1) for end, size in zip(ends, sizes, strict=True)]
    lengths = [float(np.linalg.norm(column)) for column in columns]
    if any(size > 1 and not length > 0 for size, length in zip(sizes, lengths, strict=True)):
        return None
    shortest = min((length for length in lengths if length > 0), default=1.0)
    most = tolerance(_ROUNDINGS * rounding_of(points), shortest)
    layer_of_steps = np.arange(sizes[1])[:, np.newaxis, np.newaxis] * columns[1]
    layer_of_steps = layer_of_steps + np.arange(sizes[0])[:, np.newaxis] * columns[0]
    for k, layer in enumerate(points):
        if np.abs(layer - (first + k * columns[2] + layer_of_steps)).max() > most:
            return None
    spacing, direction = grid_from_columns(np.column_stack(_completed(columns, shortest)))
    if abs(np.linalg.det(direction)) <= 1e-6:
        return None
    return {"spacing": spacing, "direction": direction, "origin": first}


def _completed(columns: list[Floats], length: float) -> list[Floats]:
    """Return the columns; an axis with a single sample gets one perpendicular to the others, `length` long."""
    missing = [axis for axis in range(3) if not columns[axis].any()]
    if len(missing) == 1:
        (axis,) = missing
        upright = np.cross(columns[(axis + 1) % 3], columns[(axis + 2) % 3])
        norm = np.linalg.norm(upright)
        columns[axis] = upright / (norm or 1.0) * length
    elif missing:
        # Singular vectors give directions perpendicular to the only one there is.
        kept = [axis for axis in range(3) if axis not in missing]
        basis = np.linalg.svd(columns[kept[0]][np.newaxis])[2] if kept else np.eye(3)
        for axis, column in zip(missing, basis[len(kept) :], strict=False):
            columns[axis] = column * length
    return columns


class _Position:
    """Regular grid, with the location of its points in the curvilinear grid."""

    def __init__(self, points: NDArray, resolution: Sequence[int] | None) -> None:
        self.origin = points.min(axis=(0, 1, 2)).astype(np.float64)
        extent = points.max(axis=(0, 1, 2)).astype(np.float64) - self.origin
        flat_axes = [name for name, length in zip("xyz", extent, strict=True) if not length > 0]
        if flat_axes:
            raise FileFault(f"is flat: all of its points have the same {' and the same '.join(flat_axes)}")
        self._cells = Cells(points)
        self.flat_cells = self._cells.check(self.origin, extent)
        if resolution is None:
            self.counts = _counts(points, self._cells, self.origin, extent)
        else:
            self.counts = check_resolution(resolution, [2, 2, 2])
        self.spacing = extent / (np.array(self.counts) - 1)
        self.outside = 0

    def resampled(self, values: NDArray, choice: Choice) -> NDArray:
        """Return the field's samples on the regular grid."""
        dtype = values.dtype if choice.labels else type_between(values.dtype)
        check_size(self.counts, dtype.itemsize)
        # Points in no cell have label 0, or no value.
        made = np.full(int(np.prod(self.counts)), 0 if choice.labels else np.nan, dtype)
        sample = labels_at if choice.labels else sampled_at
        found: Iterable[tuple[NDArray[np.intp], Floats]]
        if choice.kept is None:
            found = self._cells.locate(self.origin, self.spacing, self.counts)
        else:
            check_size([*self.counts, 4], 8)  # a number and three indices for each point
            found = once(choice, "located", lambda: list(self._cells.locate(self.origin, self.spacing, self.counts)))
        seen = np.zeros(made.size, np.bool_)
        for numbers, index in found:
            made[numbers], seen[numbers] = sample(values, index), True
        self.outside = int(made.size - seen.sum())
        return made.reshape(self.counts[::-1])


def _counts(points: NDArray, cells: Cells, origin: Floats, extent: Floats) -> list[int]:
    """Return samples along each world axis: as many as the smallest cell needs, within bounds.

    The bound is relative to the samples of the grid axis that extends farthest along the world axis.
    """
    smallest = np.full(3, np.inf)
    for block in cells.blocks():
        corners = cells.corners(block, origin)
        sizes = corners.max(axis=0) - corners.min(axis=0)
        sizes[sizes <= 0] = np.inf
        smallest = np.minimum(smallest, sizes.min(axis=0))
    counts = []
    for axis in range(3):
        paths = [np.abs(np.diff(points[..., axis], axis=2 - grid_axis)) for grid_axis in range(3)]
        lengths = [float(path.mean()) * path.shape[2 - grid_axis] for grid_axis, path in enumerate(paths)]
        along = points.shape[2 - int(np.argmax(lengths))]
        counts.append(resolution_for(float(extent[axis]), float(smallest[axis]), along))
    return counts
