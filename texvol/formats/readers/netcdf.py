"""netCDF, classic and netCDF-4, read by the netCDF library: a variable on coordinate axes, or on points.

The file's scale, offset and missing values apply: missing values become NaN. World axes are the x, y, z of the variable
by the CF conventions, in the units of its coordinates.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.curvilinear import on_points
from texvol.formats.readers.detection import TO_IMAGE
from texvol.formats.readers.missing import without_chosen
from texvol.formats.readers.netcdf_axes import (
    Dimension,
    attribute,
    dimensions_of,
    is_number,
    letters_of,
    order_of,
    role_of,
    space_of,
    unit_of,
    unstructured_kind,
)
from texvol.formats.readers.netcdf_header import check_classic, check_heaps
from texvol.formats.readers.rectilinear import Axis, axis_of, on_axes
from texvol.formats.readers.resampling import type_between
from texvol.formats.readers.samples import Choice, FileFault, Samples, check_size, check_unpacked, once, pick
from texvol.formats.units import common_length

_MOST_NAMED = 8  # variables listed in a message
_MARKS = ("_FillValue", "missing_value", "valid_range", "valid_min", "valid_max")


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of one variable at one time."""
    dataset = once(choice, "dataset", lambda: opened(path))
    try:
        return _read(dataset, choice)
    finally:
        if choice.kept is None:
            dataset.close()


def opened(path: str) -> Any:
    """Return an open dataset, scaled and masked; raise FileFault if the library would crash on the file."""
    import netCDF4

    with open(path, "rb") as file:
        is_classic = file.read(3) == b"CDF"
    if is_classic:
        check_classic(path)
    else:
        check_heaps(path)
    # The library never closes a file that it failed to open.
    check_survived(lambda: netCDF4.Dataset(os.path.abspath(path)).close())
    dataset = netCDF4.Dataset(os.path.abspath(path))
    dataset.set_auto_maskandscale(True)
    dataset.set_always_mask(False)
    return dataset


def _read(dataset: Any, choice: Choice) -> Samples:
    variable, note = _chosen(dataset, choice.variable)
    dimensions = dimensions_of(variable)
    space = space_of(dimensions)
    index = pick(letters_of(dimensions), [dimension.size for dimension in dimensions], choice)
    spatial = [dimensions[number] for number in space]
    order = order_of(spatial)
    axes = [spatial[number] for number in order]  # z, y, x
    check_size([axis.size for axis in axes], max(variable.dtype.itemsize, 8))
    # The library fills in values that were never written.
    check_unpacked(prod(axis.size for axis in axes) * variable.dtype.itemsize, os.path.getsize(dataset.filepath()))
    if isinstance(chunks := variable.chunking(), list):  # unpacked whole
        check_size(chunks, variable.dtype.itemsize)
    values, about = without_chosen(_values(variable, index, choice).transpose(order), choice)
    auxiliary = _auxiliary(dataset, variable, dimensions, spatial)
    coordinates = [auxiliary.get(role, axis.coordinate) for role, axis in zip("ZYX", axes, strict=True)]
    units = [unit_of(each) for each in coordinates]
    unit, factors, mixed = common_length(units)
    if auxiliary:
        parts = zip(dimensions, index, strict=True)
        chosen = {dimension.name: part for dimension, part in parts if not isinstance(part, slice)}
        # Positions that change with time are those of one step.
        moves = any(set(each.dimensions) & set(chosen) for each in auxiliary.values())
        points = _points(auxiliary, axes, chosen) * factors[::-1]
        samples = on_points(values, points, choice._replace(kept=None) if moves else choice)
    else:
        placed = [_axis(axis, factor) for axis, factor in zip(axes, factors, strict=True)]
        samples = on_axes(values, placed[::-1], choice)
    names = [axis.name if each is None else each.name for axis, each in zip(axes, coordinates, strict=True)]
    described = [f"{name} ({each})" if each else name for name, each in zip(names, units, strict=True)]
    return samples._replace(
        value_unit=attribute(variable, "units"), unit=unit, space=", ".join(described[::-1]),
        notes=(note, *about, *mixed), **_times(dimensions),
    )  # fmt: skip


def _chosen(dataset: Any, wanted: str | None) -> tuple[Any, str]:
    """Return the chosen variable, or the first that is a volume, and a note about it."""
    if kind := unstructured_kind(dataset):
        raise FileFault(f"is {kind}: its name must end in .e, .exo, .ex2 or .exii")
    named = dict(_variables(dataset))
    if wanted is not None and wanted not in named:
        raise FileFault(f"has no variable {wanted} (--variable); it has {_listed(list(named))}")
    name, others = (wanted, "") if wanted is not None else _first_volume(dataset, named)
    _check_variable(name, named[name], dataset)
    return named[name], f"variable {_described(name, named[name])}{others}"


def _first_volume(dataset: Any, named: dict[str, Any]) -> tuple[str, str]:
    """Return the name of the first variable that is a volume, and a note about others."""
    ancillary = _ancillary(named)
    found = [name for name, each in named.items() if name not in ancillary and _is_volume(each)]
    for each in named.values():
        if not found and (kind := unstructured_kind(dataset, each)):
            raise FileFault(f"is {kind}, which texvol does not read; {TO_IMAGE}")
    if not found:
        shapes = [f"{name} ({', '.join(each.dimensions)})" for name, each in named.items() if name not in ancillary]
        raise FileFault(f"has no variable with three axes of space; it has {_listed(shapes)}")
    others = f", the first of {len(found)}: {_listed(found)}; --variable NAME chooses" if len(found) > 1 else ""
    return found[0], others


def _variables(group: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, variable in group.variables.items():
        yield prefix + name, variable
    for name, inner in group.groups.items():
        yield from _variables(inner, f"{prefix}{name}/")


def _is_volume(variable: Any) -> bool:
    return is_number(variable) and sum(dimension.role != "T" for dimension in dimensions_of(variable)) >= 3


def _ancillary(named: dict[str, Any]) -> set[str]:
    """Return names of variables that are coordinates or bounds of others."""
    found = set()
    for name, variable in named.items():
        if variable.dimensions == (name.rpartition("/")[2],):
            found.add(name)
        for key in ("bounds", "coordinates", "climatology"):
            found |= set(attribute(variable, key).split())
    return found


def _check_variable(name: str, variable: Any, dataset: Any) -> None:
    if kind := unstructured_kind(dataset, variable):
        raise FileFault(f"its variable {name} is on {kind}, which texvol does not read; {TO_IMAGE}")
    if not is_number(variable):
        raise FileFault(f"its variable {name} must be real numbers, got {variable.dtype}")
    if not _is_volume(variable):
        sizes = zip(variable.dimensions, variable.shape, strict=True)
        listed = ", ".join(f"{dimension} {size}" for dimension, size in sizes) or "none"
        raise FileFault(f"its variable {name} must have three axes of space, got dimensions {listed}")


def _values(variable: Any, index: tuple[int | slice, ...], choice: Choice) -> NDArray:
    """Return the samples at `index`, in a type that holds NaN if the file marks or scales values.

    Missing labels become 0.
    """
    attributes = variable.ncattrs()
    values = variable[index]
    if choice.labels and np.ma.isMaskedArray(values):
        return np.ma.filled(values, 0)
    is_scaled = "scale_factor" in attributes or "add_offset" in attributes
    if variable.dtype.kind == "f" and not is_scaled:
        dtype = variable.dtype.newbyteorder("=")
    elif is_scaled or np.ma.is_masked(values) or any(mark in attributes for mark in _MARKS):
        dtype = type_between(variable.dtype)
    else:
        return np.ma.getdata(values)
    return _without_masked(values, dtype)


def _without_masked(values: NDArray, dtype: np.dtype) -> NDArray:
    """Return values in that type, NaN where masked; in the same memory if the type does not change."""
    plain = np.ma.getdata(values).astype(dtype, copy=False)
    if np.ma.is_masked(values):
        plain[np.ma.getmaskarray(values)] = np.nan
    return plain


def _axis(dimension: Dimension, factor: float = 1.0) -> Axis:
    """Return the coordinates of a dimension: those of the file times a factor, or sample numbers."""
    if dimension.coordinate is None:
        return Axis(np.arange(dimension.size, dtype=np.float64), dimension.name)
    axis = axis_of(_coordinates(dimension.coordinate, (slice(None),)), dimension.name)
    return axis.scaled(factor)


def _coordinates(variable: Any, index: tuple[Any, ...]) -> NDArray:
    """Return coordinates, NaN where the file marks them as missing."""
    check_size([max(size, 1) for size in variable.shape], 8)
    values = variable[index]
    if not np.ma.isMaskedArray(values):
        return np.asarray(values)
    return _without_masked(values, type_between(values.dtype))


def _auxiliary(
    dataset: Any, variable: Any, dimensions: Sequence[Dimension], spatial: Sequence[Dimension]
) -> dict[str, Any]:
    """Return multidimensional coordinates, by role, for the axes without coordinates of their own."""
    own = {dimension.name: dimension for dimension in dimensions}
    missing = {dimension.name for dimension in spatial if dimension.coordinate is None}
    found: dict[str, Any] = {}
    for name in attribute(variable, "coordinates").split():
        each = dataset.variables.get(name) or variable.group().variables.get(name)
        if each is None or not is_number(each):
            continue
        role = role_of(each, name)
        along = set(each.dimensions) & missing
        if role in ("X", "Y", "Z") and len(along) > 1 and set(each.dimensions) <= set(own):
            found.setdefault(role, each)
    return found


def _points(auxiliary: dict[str, Any], axes: Sequence[Dimension], chosen: dict[str, int]) -> NDArray:
    """Return the world positions of the samples, shape (nz, ny, nx, 3)."""
    sizes = [axis.size for axis in axes]
    check_size([*sizes, 3], 8)
    points = np.empty((*sizes, 3))
    for column, (role, axis) in enumerate(zip("ZYX", axes, strict=True)):
        if role in auxiliary:
            variable = auxiliary[role]
            part = _coordinates(variable, tuple(chosen.get(name, slice(None)) for name in variable.dimensions))
            names = [name for name in variable.dimensions if name not in chosen]
        else:
            part, names = _axis(axis).coordinates, [axis.name]
        # The coordinate's axes in the samples' order, and size 1 where it does not vary.
        present = [each.name for each in axes if each.name in names]
        part = part.transpose([names.index(name) for name in present])
        shape = [each.size if each.name in names else 1 for each in axes]
        points[..., 2 - column] = part.reshape(shape)
    return points


def _times(dimensions: Sequence[Dimension]) -> dict[str, Any]:
    """Return the times of the steps and their unit as in the file, such as "hours since 2001-01-01"."""
    time = next((dimension for dimension in dimensions if dimension.role == "T"), None)
    if time is None or time.coordinate is None or time.size > 10**6:
        return {}
    times = _coordinates(time.coordinate, (slice(None),)).astype(np.float64)
    if not np.isfinite(times).all():
        return {}
    return {"times": times.tolist(), "time_unit": attribute(time.coordinate, "units")}


def _described(name: str, variable: Any) -> str:
    words = [word for word in (attribute(variable, "long_name"), attribute(variable, "units")) if word]
    return f"{name} ({', '.join(words)})" if words else name


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMED
    return (", ".join(names[:_MOST_NAMED]) or "none") + (f" and {more} more" if more > 0 else "")
