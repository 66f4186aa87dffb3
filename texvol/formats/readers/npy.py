"""NPY: an array saved by numpy, with the last three axes z, y, x; needs no library but numpy."""

from __future__ import annotations

import os
from math import prod

import numpy as np

from texvol.formats.readers.colors import colored, is_colored, with_color
from texvol.formats.readers.samples import Choice, FileFault, Samples, check_size, native, pick, real_type, unnamed_axes


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of an `.npy`; files that need unpickling are refused."""
    with open(path, "rb") as file:
        version = np.lib.format.read_magic(file)
        headers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
        if version not in headers:
            raise FileFault(f"must be NPY of version 1.0 or 2.0, got {version[0]}.{version[1]}")
        sizes, is_fortran, dtype = headers[version](file)
        if dtype.hasobject:
            raise FileFault("must hold real numbers, got Python objects, which are never unpickled")
        real_type(dtype)
        axes = unnamed_axes(len(sizes))
        if choice.color:
            last = len(sizes) - 1 if len(sizes) > 3 else None
            axes = with_color(unnamed_axes(len(sizes) - 1) + "C", sizes, last, choice, "")
        index = _picked(axes, sizes, choice)
        check_size(sizes[-3:], dtype.itemsize)
        if any(size < 1 for size in sizes):
            raise FileFault(f"every dimension must be positive, got {sizes}")
        needed = dtype.itemsize * prod(sizes)
        held = os.fstat(file.fileno()).st_size - file.tell()
        if held != needed:
            raise FileFault(f"must hold {needed} bytes of samples by its header ({sizes}, {dtype}), got {held}")
        if len(sizes) == 3:
            values = native(np.fromfile(file, dtype, needed // dtype.itemsize))
            return Samples(values.reshape(sizes[::-1]).T if is_fortran else values.reshape(sizes))
        # Mapped, so that only the chosen time step takes memory.
        whole = np.memmap(file, dtype, "r", file.tell(), sizes, "F" if is_fortran else "C")
        picked = np.array(whole[index], order="C")
        return Samples(**colored(picked, axes, index, "")) if is_colored(axes) else Samples(picked)


def _picked(axes: str, sizes: tuple[int, ...], choice: Choice) -> tuple[int | slice, ...]:
    try:
        return pick(axes, sizes, choice)
    except FileFault as fault:
        may_be_color = len(sizes) == 4 and sizes[3] in (3, 4) and choice.channel is None and choice.time is None
        if may_be_color and choice.color is None:
            raise FileFault(f"{fault}; if its last axis is colour, give --color") from None
        raise
