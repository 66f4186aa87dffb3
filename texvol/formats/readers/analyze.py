"""Analyze 7.5 and SPM's variants of it: a header of 348 bytes, read by nibabel, and samples in the `.img` beside it.

The header has no directions. As nibabel and SPM do, the first axis is taken to run from right to left, the second from
back to front, the third upwards, about SPM's origin or the middle of the grid.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from texvol.formats.readers.samples import Choice, FileFault, Samples, grid_from_columns, pick, real_type, rescaled
from texvol.formats.readers.stored import Stored, encoding_of, read_picked

_BYTES = 348
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
    return Samples(values, **_grid(header), notes=(_NOTE,))


def _grid(header: Any) -> dict[str, Any]:
    steps = np.array(header["pixdim"][1:4], np.float64)
    if not (np.isfinite(steps).all() and (steps > 0).all()):
        raise FileFault("spacing must be positive, got pixdim {:g}, {:g}, {:g}".format(*steps))
    affine = header.get_best_affine()
    spacing, direction = grid_from_columns(affine[:3, :3])
    grid = {"spacing": spacing, "direction": direction, "origin": affine[:3, 3]}
    return grid | {"unit": "mm", "space": "right-anterior-superior"}
