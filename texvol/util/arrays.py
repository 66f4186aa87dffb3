"""Arrays of other libraries."""

from __future__ import annotations

from typing import Any

import numpy as np

from texvol.util.errors import InputError


def array_of(thing: Any) -> Any:
    """Return an array without a copy where the library allows; arrays of other devices come by DLPack.

    Raises
    ------
    InputError
        If it is none, or not in the processor's memory.
    """
    if isinstance(thing, np.ndarray | list | tuple) or hasattr(thing, "__array_interface__"):
        return thing
    if hasattr(thing, "__dlpack__"):
        try:
            return np.from_dlpack(thing)
        except (BufferError, RuntimeError, TypeError) as error:
            if not hasattr(thing, "__array__"):
                reason = " ".join(str(error).split())
                raise InputError(
                    f"array must be in the processor's memory, got {type(thing).__name__}: {reason}"
                ) from None
    if not hasattr(thing, "__array__"):
        wanted = "a path, a Volume, an array, or an image of xarray, nibabel, SimpleITK or pyvista"
        raise InputError(f"a volume must be {wanted}, got {type(thing).__name__}")
    return thing
