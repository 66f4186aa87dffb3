"""Volumes from and to xarray: dimensions by name, positions by coordinates, units by attributes."""

from __future__ import annotations

from typing import Any

import numpy as np

from texvol.formats.stores.arrays import open_array
from texvol.scene.volume import Volume
from texvol.util.arrays import check_is
from texvol.util.errors import InputError, missing_library


def from_xarray(array: Any, **told: Any) -> Volume:
    """Return the volume of an xarray.DataArray; one that dask computes is read part by part.

    Parameters
    ----------
    array : xarray.DataArray
        Dimensions are known by the CF attributes of their coordinates or by their names, in any order; spacing,
        origin and unit by its coordinates. Coordinates that descend make an axis of the opposite direction.
    told
        Arguments of `texvol.open_array`, such as `channel` and `time` for further dimensions.

    Raises
    ------
    InputError
        If there are no three dimensions of space, some of them are not known, or coordinates are uneven or curved.

    Warns
    -----
    UserWarning
        If the axes have units that cannot be compared, such as metres and degrees.
    """
    if hasattr(array, "data_vars"):
        listed = ", ".join(map(str, array.data_vars)) or "none"
        raise InputError(f"array must be a DataArray, got Dataset; dataset['NAME'] is one, it has {listed}")
    check_is(array, "a DataArray of xarray", "dims", "coords")
    attributes = getattr(array, "attrs", {})
    told.setdefault("name", str(array.name or attributes.get("long_name") or "array"))
    told.setdefault("value_unit", str(attributes.get("units", "")))
    volume = open_array(array, **told)
    return volume if getattr(array, "chunks", None) else volume.whole


def to_xarray(volume: Volume) -> Any:
    """Return the volume as an xarray.DataArray of dimensions (z, y, x), with coordinates in world units.

    Raises
    ------
    InputError
        If its axes are not those of the world, which coordinates cannot say.
    """
    try:
        import xarray
    except ImportError as error:
        raise missing_library("xarray", "a DataArray") from error
    signs = np.sign(np.diag(volume.direction))
    if not np.array_equal(volume.direction, np.diag(signs)):
        raise InputError(
            f"{volume.name}: coordinates need axes along x, y, z, got direction {volume.direction.tolist()}"
        )
    coordinates = {}
    for axis, name in enumerate("xyz"):
        positions = volume.origin[axis] + signs[axis] * volume.spacing[axis] * np.arange(volume.dimensions[axis])
        coordinates[name] = (name, positions, {"axis": name.upper()} | ({"units": volume.unit} if volume.unit else {}))
    attributes = {"units": volume.value_unit} if volume.value_unit else {}
    values = volume.whole.values
    return xarray.DataArray(values, coordinates, ("z", "y", "x"), name=volume.name, attrs=attributes)
