"""Unstructured grids: cells of several kinds become tetrahedra, and their field is sampled on a regular grid.

The regular grid lies along the world's axes, over the bounding box. The samples are those of the field itself, linear
in each tetrahedron or constant in each cell; samples in no cell are NaN. The error that `info` tells is that of the
field that is drawn between the samples: at the points and at the middles of the tetrahedra.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.missing import without_chosen
from texvol.formats.readers.rasterising import rasterise
from texvol.formats.readers.rectilinear import check_resolution, chosen_by
from texvol.formats.readers.resampling import Difference, Floats, labels_at, resolution_for, sampled_at, type_between
from texvol.formats.readers.samples import (
    Choice,
    FileFault,
    Samples,
    TimeSteps,
    check_size,
    out_of_range,
    real_type,
    without_axis,
)
from texvol.formats.readers.splitting import SHAPES, split
from texvol.scene.tetrahedra import TetrahedralGrid
from texvol.util.errors import InputError

_CHUNK = 2**16  # tetrahedra per step
# The finest spacing of a grid is the extent that so many of its tetrahedra do not reach: slivers have any extent.
_FINEST = 0.05
# Intervals along each axis, at least, if the tetrahedra do not fill their box: samples show a border as steps.
_LEAST_INTERVALS = 64
_FILLED = 1 - 1e-6  # of the box: the border of float32 points is rough by a ten-millionth
# Cells without a volume, which are left out with a note.
FLAT_KINDS = ("vertices", "lines", "triangles", "quadrilaterals", "polygons")


class Cells(NamedTuple):
    """Cells of one kind: a key of SHAPES or of FLAT_KINDS, corners of shape (m, corners), and their places in the file.

    `of_higher_order` is True if the cells have further nodes, which are left out.
    """

    kind: str
    corners: NDArray
    places: NDArray[np.intp]
    of_higher_order: bool = False


class Field(NamedTuple):
    """Values at the points or in the cells of a grid, shape (n, components), and the array's name."""

    values: NDArray
    at_points: bool
    name: str


def samples_of(grid: TetrahedralGrid, notes: Sequence[str], choice: Choice) -> Samples:
    """Return samples on a regular grid of a field on tetrahedra; `choice.resolution` (nx, ny, nz) overrides its own."""
    if choice.labels and not grid.per_cell:
        raise FileFault("--labels must be of cells in an unstructured grid, got values at its points")
    dtype = grid.values.dtype if choice.labels else type_between(grid.values.dtype)
    chosen = choice.resolution
    counts = _counts(grid) if chosen is None else check_resolution(chosen, [2, 2, 2])
    check_size(counts, dtype.itemsize)
    spacing = grid.extent / (np.array(counts) - 1)
    made = np.full(int(np.prod(counts)), 0 if choice.labels else np.nan, dtype)
    outside = rasterise(grid, spacing, counts, made)
    volume = made.reshape(counts[::-1])
    about: dict[str, Any] = {"grid": "unstructured", "tetrahedra": grid.count, "points": len(grid.points)}
    about |= {"dimensions": counts, "chosen_by": chosen_by(chosen), **_lost(grid, volume, spacing, choice.labels)}
    where = "the middles of its tetrahedra" if grid.per_cell else "its points and the middles of its tetrahedra"
    about |= {"compared_at": where, "outside": outside, "flat_cells": grid.flat}
    return Samples(volume, spacing.tolist(), grid.low.tolist(), resampling=about, notes=tuple(notes))


def _lost(grid: TetrahedralGrid, made: NDArray, spacing: Floats, labels: bool) -> dict[str, Any]:
    """Return the error of the regular grid at points and middles of tetrahedra, or the number of changed labels."""
    difference, changed = Difference(), 0
    if not grid.per_cell:
        used = np.unique(grid.tetrahedra)
        for begin in range(0, len(used), _CHUNK):
            some = used[begin : begin + _CHUNK]
            difference.add(grid.values[some], sampled_at(made, (grid.points[some] - grid.low) / spacing))
    for begin in range(0, grid.count, _CHUNK):
        part = slice(begin, begin + _CHUNK)
        index = grid.corners(part).mean(axis=1) / spacing
        if labels:
            changed += int((labels_at(made, index) != grid.values[part]).sum())
        else:
            own = grid.values[part] if grid.per_cell else grid.corner_values(part).mean(axis=1)
            difference.add(own, sampled_at(made, index))
    return {"changed": changed, "compared": grid.count} if labels else difference.metadata()


def _counts(grid: TetrahedralGrid) -> list[int]:
    """Return samples along each world axis: as many as the finest spacing needs, within bounds.

    The bounds are relative to the number of cells that the mean extent of a tetrahedron makes along the axis. A grid
    that does not fill its box has at least some samples, for its border.
    """
    sizes = np.concatenate([
        np.ptp(grid.corners(slice(begin, begin + _CHUNK)), axis=1) for begin in range(0, grid.count, _CHUNK)
    ])  # fmt: skip
    counts = []
    for axis in range(3):
        finest, extent = float(np.quantile(sizes[:, axis], _FINEST)), float(grid.extent[axis])
        along = int(np.ceil(min(extent / float(sizes[:, axis].mean()), 2.0**31))) + 1
        counts.append(resolution_for(extent, finest, along))
    if _filled(grid) > _FILLED:
        return counts
    # Whole multiples, so that samples stay where they were.
    return [-(-_LEAST_INTERVALS // (count - 1)) * (count - 1) + 1 for count in counts]


def _filled(grid: TetrahedralGrid) -> float:
    """Return the volume of the tetrahedra as a fraction of that of their box."""
    total = 0.0
    for begin in range(0, grid.count, _CHUNK):
        corners = grid.corners(slice(begin, begin + _CHUNK)) / grid.extent
        a, b, c = (corners[:, number] - corners[:, 0] for number in (1, 2, 3))
        total += float(np.abs((np.cross(a, b) * c).sum(axis=1)).sum()) / 6
    return total


def tetrahedral(
    points: NDArray, cells: Sequence[Cells], field: Field, choice: Choice, *, rank: NDArray | None = None
) -> tuple[TetrahedralGrid, tuple[str, ...]]:
    """Return the field of a file on tetrahedra, and notes.

    Parameters
    ----------
    points : array of shape (n, 3)
    cells : sequence of Cells
    field : Field
        Its values at points that no cell uses are ignored.
    choice : Choice
        `channel` and `missing`.
    rank : array of shape (n,), optional
        See `split`.

    Raises
    ------
    FileFault
        If no cell has a volume, a corner is no point, the field has no component that is chosen, or is no number.
    """
    solid = [each for each in cells if each.kind in SHAPES and len(each.corners)]
    if not solid:
        found = ", ".join(f"{each.kind} ({len(each.corners)})" for each in cells if len(each.corners))
        raise FileFault(f"has no cells with a volume, only {found or 'none at all'}")
    for each in solid:
        if each.corners.min() < 0 or each.corners.max() >= len(points):
            wrong = each.corners.min() if each.corners.min() < 0 else each.corners.max()
            raise FileFault(f"a cell of its {each.kind}s must have corners 0 to {len(points) - 1}, got {wrong}")
    parts = [split(each.kind, each.corners, rank) for each in solid]
    values, notes = without_chosen(_component(field, choice)[np.newaxis], choice)
    own = values[0]
    if not field.at_points:
        own = own[np.concatenate([each.places[part[1]] for each, part in zip(solid, parts, strict=True)])]
    tetrahedra = np.concatenate([part[0] for part in parts])
    if not len(tetrahedra):
        raise FileFault("has no cells with a volume: each names a point twice")
    try:
        grid = TetrahedralGrid(points, tetrahedra, own, per_cell=not field.at_points)
    except InputError as error:
        raise FileFault(
            str(error).replace("points must", "its points must").replace("tetrahedra", "its cells")
        ) from None
    return grid, (*notes, *_notes(cells, grid))


def _component(field: Field, choice: Choice) -> NDArray:
    """Return one component of a field; raise TimeSteps if these are counted."""
    if choice.counting:
        raise TimeSteps(1)
    if choice.time:
        raise without_axis("T", choice.time, "one time step")
    components = field.values.shape[1]
    if components > 1 and choice.channel is None:
        where = "point" if field.at_points else "cell"
        raise FileFault(
            f"its array {field.name} has {components} components for each {where}; choose one with --channel "
            f"0..{components - 1}"
        )
    chosen = choice.channel or 0
    if not 0 <= chosen < components:
        raise out_of_range("C", chosen, components)
    values = field.values[:, chosen]
    real_type(values.dtype)
    if choice.labels and values.dtype.kind not in "iu":
        raise FileFault(f"--labels must be whole numbers, got {values.dtype} in its array {field.name}")
    return values.astype(np.uint8) if values.dtype.kind == "b" else values


def _notes(cells: Sequence[Cells], grid: TetrahedralGrid) -> list[str]:
    notes = []
    split_kinds = {each.kind: 0 for each in cells if each.kind in SHAPES and each.kind != "tetrahedron"}
    for each in cells:
        if each.kind in split_kinds:
            split_kinds[each.kind] += len(each.corners)
    if listed := ", ".join(f"{count} {_plural(kind, count)}" for kind, count in split_kinds.items() if count):
        notes.append(f"split into tetrahedra: {listed}")
    curved = sum(len(each.corners) for each in cells if each.of_higher_order)
    if curved:
        notes.append(f"{curved} cells of higher order are taken by their corners, straight and linear")
    flat: dict[str, int] = {}
    for each in cells:
        if each.kind not in SHAPES:
            flat[each.kind] = flat.get(each.kind, 0) + len(each.corners)
    if listed := ", ".join(f"{kind} ({count})" for kind, count in flat.items() if count):
        notes.append(f"left out, without a volume: {listed}")
    missing = grid.count - int(grid.is_whole.sum())
    if missing:
        notes.append(f"{missing} of {grid.count} tetrahedra have missing values and show nothing")
    return notes


def _plural(kind: str, count: int) -> str:
    if count == 1:
        return kind
    return "hexahedra" if kind == "hexahedron" else f"{kind}s"


def chosen_name(
    named: Mapping[str, bool], wanted: str | None, marked: str | None = None
) -> tuple[str, tuple[str, ...]]:
    """Return the array to read, and a note that lists the others.

    Parameters
    ----------
    named : mapping
        Names of the arrays, those at points first; True for those at points.
    wanted : str, optional
        Name after --variable.
    marked : str, optional
        Name of the array that the file marks as its scalars.
    """
    listed = ", ".join(named) or "none"
    if wanted is not None and wanted not in named:
        raise FileFault(f"has no array {wanted} (--variable); it has {listed}")
    if not named:
        raise FileFault("has no values at its points or in its cells")
    chosen = wanted if wanted is not None else marked if marked in named else None
    if chosen is None:
        # As in VTK's other grids, arrays in cells are only looked at where none is at points.
        first = [name for name in named if named[name]] or list(named)
        if len(first) > 1:
            raise FileFault(f"has no array marked as Scalars; it has {listed}; --variable NAME chooses")
        chosen = first[0]
    others = [name for name in named if name != chosen]
    return chosen, (f"array {chosen}; others: {', '.join(others)}",) if others else ()
