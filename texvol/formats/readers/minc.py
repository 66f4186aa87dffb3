"""MINC 1 (netCDF) and 2 (HDF5), read by nibabel: values scaled slice by slice, axes in the file's order.

World coordinates are RAS+: x to the right, y to the front, z up. Opening is tried in a process of its own, since damage
may end or stop it. What nibabel requires of a file and MINC does not is supplied: the range of the values, which is 0
to 1 as in libminc, and even steps along other axes than those of space.
"""

from __future__ import annotations

import os
from typing import Any, ClassVar

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

_SPACE = ("xspace", "yspace", "zspace")


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of a `.mnc`."""
    check_survived(lambda: _described(_opened(path)))
    file = _opened(path)
    names, sizes, dtype = _described(file)
    held = os.path.getsize(path)
    needed = int(np.prod(sizes, dtype=np.float64)) * dtype.itemsize
    if is_hdf5(path):
        check_unpacked(needed, held)
    elif needed > held:
        raise FileFault(f"holds {held} bytes, but its {by(sizes)} samples need {needed}")
    # The volume's axes are those of the file, whatever their names: the last one is the fastest.
    letters = "".join("T" if name == "time" else "C" if name == "vector_dimension" else "S" for name in names)
    axes = "".join(letter if letter != "S" else "ZYX"[letters[:at].count("S")] for at, letter in enumerate(letters))
    index = pick(axes, sizes, choice)
    check_size([size for size, part in zip(sizes, index, strict=True) if isinstance(part, slice)], 8)
    return Samples(_values(file, index, dtype), **_grid(file), unit="mm", space="right-anterior-superior")


class _Range:
    """Stand-in for a variable image-min or image-max that a file does not have."""

    dimensions = ()
    attrs: ClassVar[dict[str, Any]] = {}
    shape = ()

    def __init__(self, value: float) -> None:
        self.value = value

    def getValue(self) -> float:
        """Return the value of a netCDF variable."""
        return self.value

    def __getitem__(self, index: tuple[()]) -> float:
        return self.value


class _Even:
    """Stand-in for a variable that describes an axis of time or of components."""

    spacing = b"regular__"
    attrs: ClassVar[dict[str, Any]] = {"spacing": spacing}


_RANGES = {"image-max": _Range(1.0), "image-min": _Range(0.0)}


def _opened(path: str) -> Any:
    """Return nibabel's file of MINC."""
    from nibabel.externals.netcdf import netcdf_file
    from nibabel.minc1 import Minc1File
    from nibabel.minc2 import Minc2File

    if not is_hdf5(path):
        file = netcdf_file(path, mmap=False)  # a map would outlive an error, and be warned of
        if "image" not in file.variables:
            raise FileFault("has no variable image")
        described = _RANGES | file.variables
        described |= {name: _Even() for name in file.variables["image"].dimensions if not name.endswith("space")}
        file.variables = described
        return Minc1File(file)
    import h5py

    root = h5py.File(path, "r").get("minc-2.0")
    image = root.get("image/0") if isinstance(root, h5py.Group) else None
    if not isinstance(image, h5py.Group) or not isinstance(image.get("image"), h5py.Dataset):
        raise FileFault("has no dataset minc-2.0/image/0/image")
    axes = _Axes(root["dimensions"])
    return Minc2File({"minc-2.0": {"image": {"0": {**_RANGES, **dict(image.items())}}, "dimensions": axes}})


class _Axes:
    """Descriptions of a MINC 2 file's axes by their names."""

    def __init__(self, described: Any) -> None:
        self._described = described

    def __getitem__(self, name: str) -> Any:
        return self._described[name] if name.endswith("space") else _Even()


def is_hdf5(path: str) -> bool:
    """True if a file is MINC 2."""
    with open(path, "rb") as file:
        return file.read(4) == b"\x89HDF"


def _described(file: Any) -> tuple[list[str], list[int], np.dtype]:
    """Return names and sizes of the axes, and the stored type."""
    names, sizes = [str(name) for name in file._dim_names], [int(size) for size in file.get_data_shape()]
    check_size(sizes, 1)
    if sorted(name for name in names if name not in ("time", "vector_dimension")) != sorted(_SPACE):
        raise FileFault(f"must have the axes xspace, yspace and zspace, got {', '.join(names)}")
    return names, sizes, real_type(np.dtype(file.get_data_dtype()))


def _values(file: Any, index: tuple[int | slice, ...], dtype: np.dtype) -> NDArray:
    """Return scaled values, in whole numbers where all of them are."""
    values = np.asarray(file.get_scaled_data(index))
    limits = np.iinfo(dtype) if dtype.kind in "iu" else None
    if limits is not None and values.size and np.array_equal(values, np.round(values)):
        low, high = float(values.min()), float(values.max())
        if limits.min <= low and high <= limits.max:
            return values.astype(dtype.newbyteorder("="))
    return values.astype(type_between(dtype))


def _grid(file: Any) -> dict[str, Any]:
    affine = np.asarray(file.get_affine(), np.float64)
    spacing, direction = grid_from_columns(affine[:3, 2::-1])  # nibabel's first axis is the slowest
    return {"spacing": spacing, "direction": direction, "origin": affine[:3, 3]}
