"""Meaning of a netCDF variable's dimensions: time, axes of space, and coordinates.

By the CF conventions an axis is identified by its attribute `axis`, its standard name, its units or its direction
(`positive`); without these its name decides, and then the order: the last three dimensions are z, y, x.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from texvol.formats.units import length_unit

_STANDARD_NAMES = {
    "T": ("time",),
    "X": ("longitude", "projection_x_coordinate", "grid_longitude"),
    "Y": ("latitude", "projection_y_coordinate", "grid_latitude"),
    "Z": ("height", "altitude", "depth", "air_pressure", "model_level_number"),
}
_USUAL_NAMES = {
    "T": ("time", "t", "ocean_time", "xtime", "valid_time"),
    "X": ("x", "lon", "longitude", "west_east", "rlon"),
    "Y": ("y", "lat", "latitude", "south_north", "rlat"),
    "Z": ("z", "lev", "level", "levels", "plev", "depth", "height", "altitude", "pressure", "bottom_top", "deptht"),
}
_PRESSURE = ("pa", "hpa", "mb", "mbar", "millibar", "millibars", "bar", "dbar", "decibar", "kpa", "pascal")
_UNSTRUCTURED = ("ncells", "ncell", "ncells_2", "nmesh2_face", "nmesh2d_face", "cell", "ncol", "num_nodes", "num_elem")


class Dimension(NamedTuple):
    """Dimension of a variable: name, size, role ("X", "Y", "Z", "T" or "") and coordinates."""

    name: str
    size: int
    role: str
    coordinate: Any | None


def dimensions_of(variable: Any) -> list[Dimension]:
    """Return the dimensions of a netCDF4 variable, slowest first."""
    found = []
    for dimension in variable.get_dims():
        candidate = dimension.group().variables.get(dimension.name)
        is_one = candidate is not None and candidate.dimensions == (dimension.name,) and is_number(candidate)
        coordinate = candidate if is_one else None
        found.append(Dimension(dimension.name, int(dimension.size), role_of(coordinate, dimension.name), coordinate))
    return found


def role_of(coordinate: Any | None, name: str) -> str:
    """Return the role of an axis: "X", "Y", "Z", "T", or "" if unknown."""
    axis = attribute(coordinate, "axis").upper()
    if axis in ("X", "Y", "Z", "T"):
        return axis
    standard_name = attribute(coordinate, "standard_name").lower()
    if role := _role(_STANDARD_NAMES, standard_name):
        return role
    if standard_name.startswith(("atmosphere_", "ocean_")) and standard_name.endswith("_coordinate"):
        return "Z"
    units = attribute(coordinate, "units").lower()
    if re.search(r"\bsince\b", units):
        return "T"
    if re.fullmatch(r"degrees?_?(e|east)", units):
        return "X"
    if re.fullmatch(r"degrees?_?(n|north)", units):
        return "Y"
    if units in _PRESSURE or attribute(coordinate, "positive").lower() in ("up", "down"):
        return "Z"
    return _role(_USUAL_NAMES, name.lower())


def _role(names: dict[str, tuple[str, ...]], name: str) -> str:
    return next((role for role, known in names.items() if name in known), "")


def letters_of(dimensions: list[Dimension]) -> str:
    """Return letters for `pick`: T for time, ZYX for the dimensions of space in the file's order, C for others."""
    space = space_of(dimensions)
    names = iter("ZYX")
    return "".join(
        next(names) if number in space else "T" if dimension.role == "T" else "C"
        for number, dimension in enumerate(dimensions)
    )


def space_of(dimensions: list[Dimension]) -> list[int]:
    """Return the numbers of the dimensions of space: those with such roles, or the last three that are not time."""
    told = [number for number, dimension in enumerate(dimensions) if dimension.role in ("X", "Y", "Z")]
    if sorted(dimensions[number].role for number in told) == ["X", "Y", "Z"]:
        return told
    others = [number for number, dimension in enumerate(dimensions) if dimension.role != "T"]
    # A dimension of one sample is skipped if enough others are left.
    wide = [number for number in others if dimensions[number].size > 1]
    return wide[-3:] if len(wide) >= 3 else others[-3:]


def order_of(dimensions: list[Dimension]) -> list[int]:
    """Return the positions of z, y and x among three dimensions of space in the file's order."""
    roles = [dimension.role for dimension in dimensions]
    return [roles.index(role) for role in "ZYX"] if sorted(roles) == ["X", "Y", "Z"] else [0, 1, 2]


def unstructured_kind(dataset: Any, variable: Any | None = None) -> str:
    """Return the kind of unstructured grid of a file or variable, or "" if it has none."""
    names = {name.lower() for name in dataset.dimensions}
    if {"num_nodes", "num_elem"} <= names or "num_nod_per_el1" in names:
        return "an Exodus mesh"
    if variable is None:
        return ""
    if attribute(variable, "mesh"):
        return "an unstructured grid (UGRID)"
    dimensions = {name.lower() for name in variable.dimensions}
    if attribute(variable, "CDI_grid_type").lower() == "unstructured" or dimensions & set(_UNSTRUCTURED):
        return "an unstructured grid"
    return ""


def attribute(variable: Any | None, name: str) -> str:
    """Return an attribute of a netCDF4 variable, or of a coordinate of xarray, as text, empty if there is none."""
    if isinstance(told := getattr(variable, "attrs", None), Mapping):
        value = told.get(name)
    elif variable is None or name not in variable.ncattrs():
        return ""
    else:
        value = variable.getncattr(name)
    return value.strip() if isinstance(value, str) else ""


def unit_of(variable: Any | None) -> str:
    """Return the unit of an axis in its usual notation."""
    return length_unit(attribute(variable, "units"))


def is_number(variable: Any) -> bool:
    """True if a variable holds real numbers."""
    return isinstance(variable.dtype, np.dtype) and variable.dtype.kind in "iuf"
