"""MRC and CCP4 maps: a header of 1024 bytes, read by mrcfile, and samples after it. Lengths are in ångström.

MAPC, MAPR and MAPS say which crystal axis the columns, rows and sections of the file run along. The volume's axes are
the crystal's, so samples of a permuted file are put in their order.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.readers.samples import Choice, FileFault, Samples, by, grid_from_columns, pick, real_type
from texvol.readers.stored import read_stored

_IMOD_STAMP = 1146047817  # of files in which mode 0 may be unsigned (IMOD's extension of the format)


def read(path: str, choice: Choice) -> Samples:
    """Samples of a map, plain or packed by gzip or bzip2."""
    import mrcfile
    from mrcfile.utils import data_dtype_from_header

    with mrcfile.open(path, header_only=True) as file:
        header = file.header
        if int(header.mode) == 101:
            raise FileFault("holds samples of four bits (mode 101), which are not read")
        dtype = real_type(_imod_type(header, data_dtype_from_header(header)))
    sizes = [int(header.nz), int(header.ny), int(header.nx)]
    if min(sizes) < 1:
        raise FileFault(f"every dimension must be positive, and the header says {by(sizes[::-1])}")
    extended = int(header.nsymbt)
    if extended < 0:
        raise FileFault(f"its extended header has {extended} bytes")
    columns, rows, sections = crystal_axes = [int(header[key]) - 1 for key in ("mapc", "mapr", "maps")]
    if crystal_axes == [-1, -1, -1]:  # unset by old programs, which knew one order only
        crystal_axes = [columns, rows, sections] = [0, 1, 2]
    if sorted(crystal_axes) != [0, 1, 2]:
        raise FileFault(f"MAPC, MAPR, MAPS must be 1, 2, 3 in some order, and are {[a + 1 for a in crystal_axes]}")
    sizes, axes = _volumes(header, sizes)
    index = pick(axes, sizes, choice)
    values = _stored(path, dtype, sizes, 1024 + extended)[index]
    # File axes, slowest first, are sections, rows, columns; wanted are z, y, x.
    file_axes = [sections, rows, columns]
    values = values.transpose([file_axes.index(axis) for axis in (2, 1, 0)])
    return Samples(values, **_grid(header, crystal_axes))


def _imod_type(header: Any, dtype: np.dtype) -> np.dtype:
    extra = header["extra2"].tobytes()
    stamp, flags = (int.from_bytes(extra[at : at + 4], "little") for at in (152 - 112, 156 - 112))
    is_unsigned = int(header.mode) == 0 and stamp == _IMOD_STAMP and not flags & 1
    return np.dtype(np.uint8) if is_unsigned else dtype


def _volumes(header: Any, sizes: Sequence[int]) -> tuple[list[int], str]:
    """Shape and axes for `pick`: space groups from 401 mark a stack of volumes of MZ sections each."""
    per_volume = int(header.mz)
    if int(header.ispg) <= 400 or per_volume in (0, sizes[0]):
        return list(sizes), "ZYX"
    if per_volume < 0 or sizes[0] % per_volume:
        raise FileFault(f"is a stack of volumes of {per_volume} sections, and has {sizes[0]}")
    return [sizes[0] // per_volume, per_volume, *sizes[1:]], "?ZYX"


def _stored(path: str, dtype: np.dtype, sizes: Sequence[int], offset: int) -> NDArray:
    lower = path.lower()
    if lower.endswith(".gz"):
        return read_stored(path, dtype, sizes, encoding="deflate", skip=offset, what="it")
    if lower.endswith(".bz2"):
        return read_stored(path, dtype, sizes, encoding="bzip2", skip=offset, what="it")
    return read_stored(path, dtype, sizes, offset=offset, what="it")


def _grid(header: Any, crystal_axes: Sequence[int]) -> dict[str, Any]:
    """Steps along the crystal axes a, b, c: a along x, b in the plane of x and y (the convention of the format)."""
    lengths = np.array([float(header.cella[key]) for key in "xyz"])
    intervals = np.array([int(header[key]) for key in ("mx", "my", "mz")])
    if not lengths.any() or not intervals.all():  # no cell: the file says nothing about lengths
        return {"unit": ""}
    alpha, beta, gamma = (np.radians(float(header.cellb[key]) or 90.0) for key in ("alpha", "beta", "gamma"))
    cell = np.zeros((3, 3))
    cell[:, 0] = 1, 0, 0
    cell[:, 1] = _cosine(gamma), np.sin(gamma), 0
    x, y = _cosine(beta), (_cosine(alpha) - _cosine(beta) * _cosine(gamma)) / np.sin(gamma)
    if 1 - x * x - y * y <= 0:
        raise FileFault("the angles of its cell make no volume")
    cell[:, 2] = x, y, np.sqrt(1 - x * x - y * y)
    steps = lengths / intervals
    if not (steps > 0).all():
        raise FileFault(f"spacing must be positive along every axis, and its cell makes it {', '.join(f'{s:g}' for s in steps)}")
    columns = cell * steps
    spacing, direction = grid_from_columns(columns)
    origin = np.array([float(header.origin[key]) for key in "xyz"])
    if not origin.any():  # then crystallography's way of saying it holds: the first sample's index, in the file's axes
        starts = np.zeros(3)
        starts[list(crystal_axes)] = [int(header[key]) for key in ("nxstart", "nystart", "nzstart")]
        origin = columns @ starts
    return {"spacing": spacing, "direction": direction, "origin": origin, "unit": "Å"}


def _cosine(angle: float) -> float:
    """cos(angle), and 0 for the right angle, so that an orthogonal cell stays so."""
    return 0.0 if abs(angle - np.pi / 2) < 1e-12 else float(np.cos(angle))
