"""Volume of whatever holds one: a path, an array, or an image of another library."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from texvol.formats.interchange.medical import from_nibabel, from_sitk
from texvol.formats.interchange.named import from_xarray
from texvol.formats.interchange.vtk_images import from_pyvista
from texvol.formats.label_tables import table_for
from texvol.scene.volume import Volume
from texvol.util.arrays import array_of
from texvol.util.errors import InputError

# Arrays of these packages are read part by part, when they are asked for.
_IN_PARTS = ("dask", "zarr", "h5py")


def volume_of(thing: Any, **told: Any) -> Volume:
    """Return the volume of a path, a Volume, an array, or an image of xarray, nibabel, SimpleITK, pyvista or VTK.

    Parameters
    ----------
    told
        Arguments of `texvol.load` for a path, else of `Volume`, and `label_names`.

    Raises
    ------
    InputError
        If it holds no volume, or arguments are given that its kind does not take.
    """
    if isinstance(thing, str | os.PathLike):
        from texvol.formats.readers import load

        return load(os.fspath(thing), **told)
    if isinstance(thing, Volume):
        if told:
            raise InputError(f"a Volume is what it is: {', '.join(told)} must be given when it is made")
        return thing
    if (table := told.pop("label_names", None)) is not None:
        return _named(volume_of(thing, **({"labels": True} | told)), table)
    for is_one, convert in ((_is_xarray, from_xarray), (_is_nibabel, from_nibabel), (_is_sitk, from_sitk)):
        if is_one(thing):
            return _converted(convert, thing, told)
    if hasattr(thing, "GetPointData"):
        return _converted(from_pyvista, thing, told)
    if type(thing).__module__.split(".")[0] in _IN_PARTS or isinstance(thing, np.memmap):
        from texvol.formats.stores.arrays import open_array

        return _converted(open_array, thing, told)
    return _converted(Volume, array_of(thing), told)


def _named(volume: Volume, table: str | os.PathLike[str]) -> Volume:
    """Return the volume with the names and colours of labels of a file."""
    volume.label_table = table_for(volume.name, os.fspath(table))
    return volume


def _converted(convert: Any, thing: Any, told: dict[str, Any]) -> Volume:
    try:
        volume: Volume = convert(thing, **told)
    except TypeError as error:
        if "unexpected keyword" not in str(error):
            raise
        name = str(error).rpartition("argument ")[2]
        raise InputError(f"{name} does not go with {type(thing).__name__}, which says it itself") from None
    return volume


def _is_xarray(thing: Any) -> bool:
    return hasattr(thing, "dims") and hasattr(thing, "coords")


def _is_nibabel(thing: Any) -> bool:
    return hasattr(thing, "dataobj") and hasattr(thing, "affine")


def _is_sitk(thing: Any) -> bool:
    return hasattr(thing, "GetNumberOfComponentsPerPixel") and hasattr(thing, "GetDirection")
