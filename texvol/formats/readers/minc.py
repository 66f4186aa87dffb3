"""MINC 1 (netCDF) and 2 (HDF5), read by nibabel: values scaled slice by slice, axes in the file's order.

World coordinates are RAS+: x to the right, y to the front, z up. Opening is tried in a process of its own, since damage
may end or stop it.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.resampling import type_between
from texvol.formats.readers.samples import (
    Choice,
    FileFault,
    Samples,
    by,
    check_size,
    check_unpacked,
    grid_from_columns,
    pick,
    real_type,
)

_SPACE = {"xspace": "X", "yspace": "Y", "zspace": "Z"}


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of a `.mnc`."""
    import nibabel

    check_survived(lambda: _described(nibabel.load(path)))
    image: Any = nibabel.load(path)
    names, sizes, dtype = _described(image)
    held = os.path.getsize(path)
    is_packed = type(image).__name__ == "Minc2Image"
    needed = int(np.prod(sizes, dtype=np.float64)) * dtype.itemsize
    if is_packed:
        check_unpacked(needed, held)
    elif needed > held:
        raise FileFault(f"holds {held} bytes, but its {by(sizes)} samples need {needed}")
    # The volume's axes are those of the file, whatever their names: the last one is the fastest.
    letters = "".join("T" if name == "time" else "C" if name == "vector_dimension" else "S" for name in names)
    if letters.count("S") != 3:
        raise FileFault(f"must have the axes xspace, yspace and zspace, got {', '.join(names)}")
    axes = "".join(letter if letter != "S" else "ZYX"[letters[:at].count("S")] for at, letter in enumerate(letters))
    index = pick(axes, sizes, choice)
    check_size([size for size, part in zip(sizes, index, strict=True) if isinstance(part, slice)], 8)
    return Samples(_values(image, index, dtype), **_grid(image), unit="mm", space="right-anterior-superior")


def _described(image: Any) -> tuple[list[str], list[int], np.dtype]:
    """Return names and sizes of the axes, and the stored type."""
    file = image.dataobj.minc_file
    sizes = [int(size) for size in file.get_data_shape()]
    check_size(sizes, 1)
    return [str(name) for name in file._dim_names], sizes, real_type(np.dtype(file.get_data_dtype()))


def _values(image: Any, index: tuple[int | slice, ...], dtype: np.dtype) -> NDArray:
    """Return scaled values, in whole numbers where all of them are."""
    values = np.asarray(image.dataobj[index])
    limits = np.iinfo(dtype) if dtype.kind in "iu" else None
    if limits is not None and values.size and np.array_equal(values, np.round(values)):
        low, high = float(values.min()), float(values.max())
        if limits.min <= low and high <= limits.max:
            return values.astype(dtype.newbyteorder("="))
    return values.astype(type_between(dtype))


def _grid(image: Any) -> dict[str, Any]:
    affine = np.asarray(image.affine, np.float64)
    spacing, direction = grid_from_columns(affine[:3, 2::-1])  # nibabel's first axis is the slowest
    return {"spacing": spacing, "direction": direction, "origin": affine[:3, 3]}
