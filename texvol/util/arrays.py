"""Arrays of other libraries."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from texvol.util.errors import InputError


def array_of(thing: Any) -> Any:
    """Return an array without a copy where the library allows; arrays of other devices come by DLPack.

    Raises
    ------
    InputError
        If it is none, or numpy cannot read it, since it is ragged or on another device.
    """
    if isinstance(thing, np.ndarray):
        return thing
    is_list = isinstance(thing, list | tuple)
    if not is_list and not any(hasattr(thing, f"__{how}__") for how in ("array_interface", "dlpack", "array")):
        wanted = "a path, a Volume, an array, or an image of xarray, nibabel, SimpleITK or pyvista"
        raise InputError(f"a volume must be {wanted}, got {type(thing).__name__}")
    try:
        if hasattr(thing, "__dlpack__") and not hasattr(thing, "__array_interface__"):
            try:
                return np.from_dlpack(thing)
            except (BufferError, RuntimeError, TypeError, ValueError):
                if not hasattr(thing, "__array__"):
                    raise
        return np.asarray(thing)
    except (BufferError, RuntimeError, TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"array must be one that numpy can read, got {type(thing).__name__}: {reason}") from None


def check_is(image: Any, wanted: str, *attributes: str) -> None:
    """Raise InputError unless an image of another library has the attributes by which it is known."""
    if all(hasattr(image, each) for each in attributes):
        return
    is_path, is_array = isinstance(image, str | os.PathLike), hasattr(image, "__array__")
    advice = "; texvol.load reads a file" if is_path else "; texvol.Volume is one of an array" if is_array else ""
    raise InputError(f"image must be {wanted}, got {type(image).__name__}{advice}")
