"""Slices of DICOM that are unevenly apart or not behind each other, on a grid at right angles to them.

With positions p_k of the first pixels, u and v the directions of columns and rows, and n their normal, slice k lies at
the depth d_k = n·(p_k - p_0), shifted by a_k = (u·(p_k - p_0), v·(p_k - p_0)) within its plane. At a depth d between
two slices the field is linear between both, at the pixel that lies at the same place relative to the shift a(d), which
is linear in between as well: the field of a sheared grid for even slices of a tilted gantry. Points beside the slices
are missing, or label 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.dicom_slices import Slice
from texvol.formats.readers.rectilinear import check_resolution, chosen_by
from texvol.formats.readers.resampling import (
    Difference,
    Floats,
    labels_at,
    nearest,
    resolution_for,
    slices_at,
    type_between,
)
from texvol.formats.readers.samples import Choice, FileFault, Samples, check_size

_OUTSIDE = 0.5  # of a pixel, up to which the outermost pixels reach
_CLOSE = 0.05  # of the usual distance of slices: a smaller one does not decide on the grid


class _Stack(NamedTuple):
    """Places of slices: depth along the normal and shifts along columns and rows, world units from the first slice."""

    depths: Floats  # shape (n,), ascending
    shifts: Floats  # shape (n, 2)
    spacing: Floats  # of columns and rows
    sizes: tuple[int, int, int]  # columns, rows, slices

    def at(self, depths: Floats) -> tuple[Floats, Floats]:
        """Return index among the slices and shifts at some depths."""
        index = np.interp(depths, self.depths, np.arange(len(self.depths)))
        return index, np.column_stack([np.interp(depths, self.depths, self.shifts[:, axis]) for axis in (0, 1)])


class _Grid(NamedTuple):
    """Regular grid: place of its first sample relative to the first pixel of the first slice, spacing and samples."""

    start: Floats
    spacing: Floats
    counts: list[int]


def on_even_slices(values: NDArray, ordered: Sequence[Slice], choice: Choice) -> Samples:
    """Return samples on a regular grid, with the error at the source's pixels.

    Parameters
    ----------
    values : array of shape (nz, ny, nx)
        Pixels of the slices, in the order of their depths.
    ordered : sequence of Slice
    choice : Choice
        `resolution` (mx, my, mz) of the grid; else pixels keep their distance, and slices get that of the nearest two.
        Labels get the nearest pixel's value.
    """
    first = ordered[0]
    axes = np.array([*first.axes, np.cross(*first.axes)])
    away = (np.array([one.position for one in ordered]) - first.position) @ axes.T
    stack = _Stack(away[:, 2], away[:, :2], np.array(first.spacing), (*values.shape[:0:-1], len(ordered)))
    grid = _grid(stack, choice.resolution)
    made = _made(values, stack, grid, choice.labels)
    lost = _lost(values, stack, made, grid, choice.labels)
    about: dict[str, Any] = {"grid": "sliced", "samples": list(stack.sizes), "dimensions": grid.counts}
    about |= {"chosen_by": _chosen_by(choice.resolution), **lost}
    origin = np.array(first.position) + grid.start @ axes
    return Samples(made, grid.spacing.tolist(), origin.tolist(), axes.T, resampling=about)


def _chosen_by(resolution: Sequence[int] | None) -> str:
    return "by the nearest two slices; --resolution NX,NY,NZ overrides" if resolution is None else chosen_by(resolution)


def _grid(stack: _Stack, resolution: Sequence[int] | None) -> _Grid:
    """Return the grid from the least to the largest shift and depth."""
    if len(stack.depths) < 2:
        raise FileFault("--resample needs at least two slices")
    low, high = stack.shifts.min(axis=0), stack.shifts.max(axis=0)
    start = np.array([*low, stack.depths[0]])
    inner = np.array([*(np.array(stack.sizes[:2]) - 1) * stack.spacing, 0.0])
    extent = np.array([*(high - low), stack.depths[-1] - stack.depths[0]]) + inner
    if resolution is not None:
        counts = check_resolution(resolution, stack.sizes)
    else:
        gaps = np.diff(stack.depths)
        nearest_gap = float(gaps[gaps > _CLOSE * np.median(gaps)].min())
        counts = [int(np.ceil(round(extent[axis] / stack.spacing[axis], 6))) + 1 for axis in (0, 1)]
        counts.append(resolution_for(float(extent[2]), nearest_gap, stack.sizes[2]))
        # Pixels stay where they are, so that slices without a shift are only blended along their normal.
        extent = np.array([*(np.array(counts[:2]) - 1) * stack.spacing, extent[2]])
    steps = np.maximum(np.array(counts) - 1, 1)
    spacing = np.where(extent > 0, extent / steps, [*stack.spacing, 1.0])
    return _Grid(start, spacing, counts)


def _made(values: NDArray, stack: _Stack, grid: _Grid, labels: bool) -> NDArray:
    """Return the field on the grid."""
    dtype = values.dtype if labels else type_between(values.dtype)
    check_size(grid.counts, dtype.itemsize)
    made = np.empty(grid.counts[::-1], dtype)
    depths = grid.start[2] + np.arange(grid.counts[2]) * grid.spacing[2]
    index, shifts = stack.at(depths)
    planes = _nearest_planes(values, index) if labels else _between(values, index)
    for slot, plane, shift in zip(made, planes, shifts, strict=True):
        x, y = (
            (grid.start[axis] + np.arange(grid.counts[axis]) * grid.spacing[axis] - shift[axis]) / stack.spacing[axis]
            for axis in (0, 1)
        )
        beside = _beside(y, stack.sizes[1])[:, np.newaxis] | _beside(x, stack.sizes[0])
        if labels:
            rows, columns = (
                np.clip(nearest(each), 0, size - 1) for each, size in ((y, plane.shape[0]), (x, plane.shape[1]))
            )
            slot[...] = np.where(beside, 0, plane[np.ix_(rows, columns)])
        else:
            found = next(slices_at(plane[np.newaxis], [x, y, np.zeros(1)]))
            slot[...] = np.where(beside, np.nan, found)
    return made


def _beside(index: Floats, size: int) -> NDArray[np.bool_]:
    return (index < -_OUTSIDE - 1e-6) | (index > size - 1 + _OUTSIDE + 1e-6)


def _between(values: NDArray, index: Floats) -> Iterator[NDArray]:
    """Yield the slices at some indices, linear between those of the source."""
    return slices_at(values, [np.arange(values.shape[2], dtype=float), np.arange(values.shape[1], dtype=float), index])


def _nearest_planes(values: NDArray, index: Floats) -> Iterator[NDArray]:
    return (values[number] for number in np.clip(nearest(index), 0, len(values) - 1))


def _lost(values: NDArray, stack: _Stack, made: NDArray, grid: _Grid, labels: bool) -> dict[str, Any]:
    """Return the error of the grid at the source's pixels, or the number of changed labels."""
    difference, changed = Difference(), 0
    rows, columns = (np.arange(size, dtype=float) for size in (stack.sizes[1], stack.sizes[0]))
    for plane, depth, shift in zip(values, stack.depths, stack.shifts, strict=True):
        x = (columns * stack.spacing[0] + shift[0] - grid.start[0]) / grid.spacing[0]
        y = (rows * stack.spacing[1] + shift[1] - grid.start[1]) / grid.spacing[1]
        z = np.full(1, (depth - grid.start[2]) / grid.spacing[2])
        if labels:
            index = np.stack(np.broadcast_arrays(x[np.newaxis, :], y[:, np.newaxis], z[0]), axis=-1).reshape(-1, 3)
            changed += int((labels_at(made, index) != plane.ravel()).sum())
        else:
            difference.add(plane, next(slices_at(made, [x, y, z])))
    return {"changed": changed, "compared": values.size} if labels else difference.metadata()
