"""Exodus, an unstructured grid in a netCDF file: blocks of cells of one kind, nodal and element variables with time."""

from __future__ import annotations

import os
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.netcdf import opened
from texvol.formats.readers.netcdf_axes import attribute, unstructured_kind
from texvol.formats.readers.samples import (
    Choice,
    FileFault,
    Samples,
    TimeSteps,
    check_size,
    check_unpacked,
    out_of_range,
)
from texvol.formats.readers.splitting import SHAPES
from texvol.formats.readers.unstructured import Cells, Field, chosen_name, samples_of, tetrahedral
from texvol.scene.tetrahedra import TetrahedralGrid

# Names of elements begin so, and may go on with their number of nodes.
_KINDS = {"TET": "tetrahedron", "PYR": "pyramid", "WED": "wedge", "HEX": "hexahedron"}
_KINDS |= {"TRI": "triangles", "SHE": "quadrilaterals", "QUA": "quadrilaterals", "SPH": "vertices", "CIR": "vertices"}
_KINDS |= {"BAR": "lines", "BEA": "lines", "TRU": "lines", "EDG": "lines"}


def read(path: str, choice: Choice) -> Samples:
    """Return samples on a regular grid of a nodal or element variable at one time."""
    grid, notes = tetrahedra(path, choice)
    with opened(path) as dataset:
        times = dataset.variables.get("time_whole")
        found = None if times is None or not times.shape[0] else np.asarray(times[:], np.float64).tolist()
    return samples_of(grid, notes, choice)._replace(times=found)


def tetrahedra(path: str, choice: Choice) -> tuple[TetrahedralGrid, tuple[str, ...]]:
    """Return the field of a file on tetrahedra, and notes."""
    with opened(path) as dataset:
        if unstructured_kind(dataset) != "an Exodus mesh":
            raise FileFault("is netCDF without the dimensions of an Exodus mesh")
        for variable in dataset.variables.values():
            check_size([max(variable.size, 1)], 8)
            check_unpacked(int(variable.size) * max(variable.dtype.itemsize, 1), os.path.getsize(path))
        step = _step(dataset, choice)
        nodal, element = _names(dataset, "name_nod_var"), _names(dataset, "name_elem_var")
        named = {name: True for name in nodal}
        for name in element:
            named.setdefault(name, False)
        name, notes = chosen_name(named, choice.variable)
        cells = _cells(dataset)
        if named[name]:
            values = _nodal(dataset, nodal.index(name), step)
        else:
            values = _of_blocks(dataset, element.index(name), step)
        field = Field(values[:, np.newaxis], named[name], name)
        points = _points(dataset)
    if len(values) != (len(points) if field.at_points else sum(len(each.places) for each in cells)):
        raise FileFault(f"its variable {name} has {len(values)} values, which are not those of its mesh")
    grid, about = tetrahedral(points, cells, field, choice._replace(time=None))
    return grid, (*notes, *about)


def _step(dataset: Any, choice: Choice) -> int:
    """Return the time step to read; raise TimeSteps if these are counted."""
    steps = max(len(dataset.dimensions["time_step"]) if "time_step" in dataset.dimensions else 1, 1)
    if choice.counting:
        raise TimeSteps(steps)
    if choice.time is None and steps > 1:
        raise FileFault(f"has {steps} time steps; choose one with --time 0..{steps - 1}")
    chosen = choice.time or 0
    if not 0 <= chosen < steps:
        raise out_of_range("T", chosen, steps)
    return int(chosen)


def _names(dataset: Any, key: str) -> list[str]:
    """Return the names of a table of characters."""
    variable = dataset.variables.get(key)
    if variable is None:
        return []
    table = np.ma.filled(np.ma.asarray(variable[:]), b"").astype("S1")
    return [b"".join(row.tolist()).split(b"\0")[0].decode("utf-8", "replace").strip() for row in np.atleast_2d(table)]


def _numbers(variable: Any, index: tuple[Any, ...] = ()) -> NDArray:
    """Return numbers of a variable, floats with NaN where one is missing."""
    part = variable[index or slice(None)]
    return np.ma.filled(part.astype(np.float64), np.nan) if np.ma.isMaskedArray(part) else np.asarray(part)


def _points(dataset: Any) -> NDArray[np.float64]:
    if "coord" in dataset.variables:
        return np.ascontiguousarray(_numbers(dataset.variables["coord"]).T, np.float64)
    axes = [dataset.variables.get(f"coord{axis}") for axis in "xyz"]
    if any(axis is None for axis in axes):
        raise FileFault("must have three coordinates, coordx, coordy and coordz")
    return np.stack([_numbers(axis).astype(np.float64) for axis in axes], axis=1)


def _blocks(dataset: Any) -> list[int]:
    """Return the numbers of the blocks of cells, ascending."""
    found = (re.fullmatch(r"connect(\d+)", name) for name in dataset.variables)
    return sorted(int(match.group(1)) for match in found if match)


def _cells(dataset: Any) -> list[Cells]:
    found, place = [], 0
    for block in _blocks(dataset):
        variable = dataset.variables[f"connect{block}"]
        name = attribute(variable, "elem_type").upper()
        kind = _KINDS.get(name[:3])
        if kind is None:
            raise FileFault(f"has cells of type {name or 'no name'} (block {block}), which texvol does not read")
        corners = np.asarray(_numbers(variable))
        count = SHAPES[kind].corners if kind in SHAPES else 0
        if corners.ndim != 2 or corners.shape[1] < count or corners.dtype.kind not in "iu":
            raise FileFault(f"block {block} of its cells, {name}, must have {count} whole numbers for each")
        places = np.arange(place, place + len(corners))
        place += len(corners)
        higher = kind in SHAPES and corners.shape[1] > count
        found.append(Cells(kind, corners[:, :count].astype(np.intp) - 1, places, higher))
    return found


def _nodal(dataset: Any, number: int, step: int) -> NDArray:
    if (variable := dataset.variables.get(f"vals_nod_var{number + 1}")) is not None:
        return np.asarray(_numbers(variable, (step,)))
    if (variable := dataset.variables.get("vals_nod_var")) is None:
        raise FileFault(f"has no values of its nodal variable {number + 1}")
    return np.asarray(_numbers(variable, (step, number)))


def _of_blocks(dataset: Any, number: int, step: int) -> NDArray:
    """Return values of all cells, NaN in blocks that have none."""
    parts = []
    for block in _blocks(dataset):
        variable = dataset.variables.get(f"vals_elem_var{number + 1}eb{block}")
        count = dataset.variables[f"connect{block}"].shape[0]
        part = np.full(count, np.nan) if variable is None else _numbers(variable, (step,))
        if len(part) != count:
            raise FileFault(f"block {block} of its cells must have {count} values, got {len(part)}")
        parts.append(part)
    if not parts:
        raise FileFault("has no cells")
    return np.concatenate(parts)
