"""Analyze 7.5 and SPM's variants of it: a header of 348 bytes, read by nibabel, and samples in the `.img` beside it.

The header has no directions. SPM writes them into a `.mat` beside it, which is read. Without one the first axis is
taken to run from right to left, the second from back to front, the third upwards, about SPM's origin or the middle of
the grid, as nibabel and SPM do.
"""

from __future__ import annotations

import os
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.samples import Choice, FileFault, Samples, grid_from_columns, pick, real_type, rescaled
from texvol.formats.readers.stored import Stored, encoding_of, read_picked
from texvol.util import reach

_BYTES = 348
_MOST_BYTES = 2**18  # of a .mat, which has 128 for each time step
_NOTE = (
    "its Analyze header has no directions: the first axis is taken to run from right to left, the second from back to "
    "front, the third upwards, as nibabel and SPM take them"
)


def is_analyze(block: bytes) -> bool:
    """True if a header is Analyze's: 348 bytes by its first number, without NIfTI's mark."""
    is_sized = block[:4] in ((_BYTES).to_bytes(4, "little"), (_BYTES).to_bytes(4, "big"))
    return is_sized and len(block) >= _BYTES and block[344:347] not in (b"n+1", b"ni1")


def read(block: bytes, data_path: str, choice: Choice) -> Samples:
    """Return the samples of an `.img` by the bytes of its header, scaled as SPM does."""
    import nibabel

    header = nibabel.Spm2AnalyzeHeader(block[:_BYTES], check=False)
    header = nibabel.Spm2AnalyzeHeader(block[:_BYTES], endianness=header.endianness, check=False)
    sizes = [int(size) for size in header["dim"][1 : 1 + int(header["dim"][0])]]
    axes = "XYZTC??"[: len(sizes)][::-1]
    index = pick(axes, sizes[::-1], choice)
    dtype = real_type(header.get_data_dtype())
    offset = float(header["vox_offset"])
    if not 0 <= offset < 2**31:
        raise FileFault(f"its samples must begin at byte 0 or later, got {offset:g}")
    stored = Stored(data_path, dtype, tuple(sizes[::-1]), encoding_of(data_path), skip=int(offset))
    values = read_picked(stored, index, choice)
    slope, intercept = header.get_slope_inter()
    if slope is not None and (slope, intercept or 0.0) != (1.0, 0.0):
        values = rescaled(values, float(slope), float(intercept or 0.0))
    beside = re.sub(r"\.img(\.gz)?$", ".mat", data_path, flags=re.IGNORECASE)
    if (matrix := _matrix(beside, choice.time or 0)) is not None:
        return Samples(values, **_placed(matrix), notes=(f"it lies where {os.path.basename(beside)} says",))
    return Samples(values, **_grid(header), notes=(_NOTE,))


def _matrix(path: str, step: int) -> NDArray[np.float64] | None:
    """Return the world matrix of a time step in SPM's file, or None without one; SPM counts samples from 1."""
    if not os.path.isfile(path):
        return None
    reach.check(path)
    name = os.path.basename(path)
    if os.path.getsize(path) > _MOST_BYTES:
        raise FileFault(f"{name} beside it must have at most {_MOST_BYTES} bytes")
    check_survived(lambda: _variables(path))
    found = _variables(path)
    # SPM 2 and later write mat. M of SPM 99 and before has x from left to right, and the samples the other way.
    matrix = np.asarray(found["mat"] if "mat" in found else np.diag([-1.0, 1, 1, 1]) @ found["M"], np.float64)
    if matrix.ndim == 3:
        matrix = matrix[:, :, min(step, matrix.shape[2] - 1)]
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise FileFault(f"{name} beside it must hold a finite matrix of 4 x 4, got shape {matrix.shape}")
    from_one = np.eye(4)
    from_one[:3, 3] = 1
    return np.asarray(matrix @ from_one)


def _variables(path: str) -> dict[str, Any]:
    from scipy.io import loadmat

    found = loadmat(path, variable_names=["mat", "M"])
    if not {"mat", "M"} & set(found):
        raise FileFault(f"{os.path.basename(path)} beside it must hold a matrix mat or M")
    return dict(found)


def _grid(header: Any) -> dict[str, Any]:
    steps = np.array(header["pixdim"][1:4], np.float64)
    if not (np.isfinite(steps).all() and (steps > 0).all()):
        raise FileFault("spacing must be positive, got pixdim {:g}, {:g}, {:g}".format(*steps))
    return _placed(header.get_best_affine())


def _placed(affine: NDArray[np.float64]) -> dict[str, Any]:
    spacing, direction = grid_from_columns(affine[:3, :3])
    grid = {"spacing": spacing, "direction": direction, "origin": affine[:3, 3]}
    return grid | {"unit": "mm", "space": "right-anterior-superior"}
