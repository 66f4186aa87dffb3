"""MRC and CCP4 maps: a header of 1024 bytes, read by mrcfile, and samples after it. Lengths are in ångström.

MAPC, MAPR and MAPS name the crystal axes of the file's columns, rows and sections. The volume's axes are the crystal's,
so samples of a permuted file are transposed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from texvol.formats.readers.samples import Choice, FileFault, Samples, by, grid_from_columns, pick, real_type
from texvol.formats.readers.stored import Stored, encoding_of, read_picked, unpacked

_HEADER_BYTES = 1024
_IMOD_STAMP = 1146047817  # mark of files in which mode 0 may be unsigned (IMOD's extension of the format)


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of a map, plain or compressed by gzip or bzip2."""
    from mrcfile.utils import data_dtype_from_header

    encoding = encoding_of(path)
    header = _header(path, encoding)
    if int(header.mode) == 101:
        raise FileFault("has samples of four bits (mode 101), which texvol does not read")
    dtype = real_type(_imod_type(header, data_dtype_from_header(header)))
    sizes = [int(header.nz), int(header.ny), int(header.nx)]
    if min(sizes) < 1:
        raise FileFault(f"every dimension must be positive, got {by(sizes[::-1])}")
    extended = int(header.nsymbt)
    if extended < 0:
        raise FileFault(f"its extended header must have at least 0 bytes, got {extended}")
    crystal_axes = _crystal_axes(header)
    sizes, axes = _volumes(header, sizes)
    index = pick(axes, sizes, choice)
    values = read_picked(Stored(path, dtype, tuple(sizes), encoding, skip=_HEADER_BYTES + extended), index, choice)
    # From sections, rows, columns to z, y, x.
    values = values.transpose([crystal_axes[::-1].index(axis) for axis in (2, 1, 0)])
    return Samples(values, **_grid(header, crystal_axes))


def _header(path: str, encoding: str) -> Any:
    """Return the first 1024 bytes with mrcfile's names; mrcfile itself would read an extended header of any length."""
    from mrcfile.dtypes import HEADER_DTYPE
    from mrcfile.utils import byte_order_from_machine_stamp

    with open(path, "rb") as file:
        block = file.read(_HEADER_BYTES) if encoding == "raw" else next(unpacked(file, encoding), b"")
    if len(block) < _HEADER_BYTES:
        raise FileFault(f"is truncated: its header of {_HEADER_BYTES} bytes has {len(block)}")
    header = np.frombuffer(block[:_HEADER_BYTES], HEADER_DTYPE).reshape(()).view(np.recarray)
    if bytes(header.map)[:3] != b"MAP":
        raise FileFault("is not MRC: its header has no 'MAP' at byte 208")
    try:
        order = byte_order_from_machine_stamp(header.machst)
    except ValueError:
        # Some programs leave the stamp empty; the mode is a small number in one byte order only.
        order = "<" if int(header.mode.view("<i4")) < 2**16 else ">"
    return header.view(np.dtype((np.record, HEADER_DTYPE.newbyteorder(order)))).view(np.recarray)


def _imod_type(header: Any, dtype: np.dtype) -> np.dtype:
    extra = header["extra2"].tobytes()
    stamp, flags = (int.from_bytes(extra[at : at + 4], "little") for at in (152 - 112, 156 - 112))
    is_unsigned = int(header.mode) == 0 and stamp == _IMOD_STAMP and not flags & 1
    return np.dtype(np.uint8) if is_unsigned else dtype


def _crystal_axes(header: Any) -> list[int]:
    """Return the axes x, y, z (0, 1, 2) of columns, rows and sections."""
    numbers = [int(header[key]) for key in ("mapc", "mapr", "maps")]
    if numbers == [0, 0, 0]:  # unset by old programs, which have one order only
        return [0, 1, 2]
    if sorted(numbers) != [1, 2, 3]:
        raise FileFault(f"MAPC, MAPR, MAPS must be 1, 2, 3 in some order, got {', '.join(map(str, numbers))}")
    return [number - 1 for number in numbers]


def _volumes(header: Any, sizes: Sequence[int]) -> tuple[list[int], str]:
    """Return shape and axes for `pick`: space groups from 401 mark a stack of volumes of MZ sections each."""
    per_volume = int(header.mz)
    if int(header.ispg) <= 400 or per_volume in (0, sizes[0]):
        return list(sizes), "ZYX"
    if per_volume < 0 or sizes[0] % per_volume:
        raise FileFault(f"is a stack of volumes of {per_volume} sections, but has {sizes[0]} sections")
    return [sizes[0] // per_volume, per_volume, *sizes[1:]], "?ZYX"


def _grid(header: Any, crystal_axes: Sequence[int]) -> dict[str, Any]:
    """Return the grid along the crystal axes a, b, c: a along x, b in the plane of x and y (by convention)."""
    lengths = np.array([float(header.cella[key]) for key in "xyz"])
    intervals = np.array([int(header[key]) for key in ("mx", "my", "mz")])
    if not lengths.any() or not intervals.all():  # no cell: the file says nothing about lengths
        return {"unit": ""}
    alpha, beta, gamma = (np.radians(float(header.cellb[key]) or 90.0) for key in ("alpha", "beta", "gamma"))
    x, y = _cosine(beta), (_cosine(alpha) - _cosine(beta) * _cosine(gamma)) / np.sin(gamma)
    if 1 - x * x - y * y <= 0:
        raise FileFault("the angles of its cell are impossible")
    cell = np.array([[1, _cosine(gamma), x], [0, np.sin(gamma), y], [0, 0, np.sqrt(1 - x * x - y * y)]])
    steps = lengths / intervals
    if not (steps > 0).all():
        raise FileFault("spacing must be positive along every axis, got {:g}, {:g}, {:g} from its cell".format(*steps))
    columns = cell * steps
    spacing, direction = grid_from_columns(columns)
    origin = np.array([float(header.origin[key]) for key in "xyz"])
    if not origin.any():  # crystallographic files give the index of the first sample instead, in the file's axes
        starts = np.zeros(3)
        starts[list(crystal_axes)] = [int(header[key]) for key in ("nxstart", "nystart", "nzstart")]
        origin = columns @ starts
    return {"spacing": spacing, "direction": direction, "origin": origin, "unit": "Å"}


def _cosine(angle: float) -> float:
    """Return cos(angle), exactly 0 for the right angle, so that an orthogonal cell stays orthogonal."""
    return 0.0 if abs(angle - np.pi / 2) < 1e-12 else float(np.cos(angle))
