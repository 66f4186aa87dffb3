"""NIfTI-1 and -2: a binary header, read by nibabel, and samples after it or in the pair's `.img`.

World coordinates are RAS+: x to the right, y to the front, z up; without an affine in the header, those of the grid.
Pairs of Analyze have the same names; `analyze` reads them.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers import analyze
from texvol.formats.readers.colors import colored, component_axis, is_colored, with_color
from texvol.formats.readers.samples import Choice, FileFault, Samples, grid_from_columns, pick, real_type, rescaled
from texvol.formats.readers.stored import Stored, encoding_of, read_picked, unpacked
from texvol.util import reach

_UNITS = {0: "mm", 1: "m", 2: "mm", 3: "µm"}  # 0 is "unknown", which readers of NIfTI take for mm
_TIME_UNITS = {8: "s", 16: "ms", 24: "µs"}
# Data types of the header that are bytes of colour, and intents that mark a vector as colour: names, components.
_RGB = {128: ("RGB24", 3), 2304: ("RGBA32", 4)}
_INTENTS = {2003: "RGB vector", 2004: "RGBA vector"}
_LABEL_INTENT = 1002


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of a `.nii`, or of an `.hdr` and its `.img`, scaled by slope and intercept."""
    header_path, data_path = _pair(path)
    if header_path != data_path and analyze.is_analyze(block := _block(header_path)):
        return analyze.read(block, data_path, choice)
    header, is_single = _header(header_path)
    sizes = [int(size) for size in header["dim"][1 : 1 + int(header["dim"][0])]]
    offset = int(header["vox_offset"])
    if offset < (len(header.binaryblock) if is_single else 0):
        raise FileFault(f"its samples begin at byte {offset}, inside its header")
    dtype = header.get_data_dtype()
    axes = _axes(len(sizes))
    intent = int(header["intent_code"])
    named, components = _RGB.get(int(header["datatype"]), (_INTENTS.get(intent, ""), 0))
    if components:
        dtype, sizes, axes = np.dtype(np.uint8), [components, *sizes], axes + "C"
    axes = with_color(axes, sizes[::-1], component_axis(axes, sizes[::-1], "C"), choice, named)
    index = pick(axes, sizes[::-1], choice)
    real_type(dtype)
    stored = Stored(data_path, dtype, tuple(sizes[::-1]), encoding_of(data_path), skip=offset)
    values = read_picked(stored, index, choice)
    grid = _grid(header) | _times(header, dict(zip(axes, sizes[::-1], strict=True)).get("T", 1))
    if is_colored(axes):
        # Bytes of colour are not scaled (the format's definition).
        return Samples(**grid, **colored(values if components else _scaled(header, values), axes, index, named))
    is_unsaid = intent == _LABEL_INTENT and not choice.labels
    notes = ("its header says that values are labels: see --labels",) if is_unsaid else ()
    return Samples(_scaled(header, values), **grid, notes=notes)


def _pair(path: str) -> tuple[str, str]:
    """Return the paths of header and samples: one file, or two of the same name."""
    for header_ending, data_ending in ((".hdr", ".img"), (".hdr.gz", ".img.gz")):
        for ending in (header_ending, data_ending):
            if path.lower().endswith(ending):
                stem = path[: -len(ending)]
                return _existing(stem, header_ending), _existing(stem, data_ending)
    return path, path


def _existing(stem: str, ending: str) -> str:
    for candidate in (stem + ending, stem + ending.upper()):
        if os.path.isfile(candidate):
            return candidate
    raise FileFault(f"is half of a NIfTI pair: {os.path.basename(stem)}{ending} must be beside it")


def _header(path: str) -> tuple[Any, bool]:
    """Return the header, checked by nibabel, and True if the samples are in the same file."""
    import nibabel

    block = _block(path)
    kinds = ((b"\x5c\x01", nibabel.Nifti1Header, 348, 344), (b"\x1c\x02", nibabel.Nifti2Header, 540, 4))
    for mark, kind, length, at in kinds:
        if block[:2] == mark or block[2:4] == mark[::-1]:
            if len(block) < length:
                raise FileFault(f"is truncated: its header of {length} bytes has {len(block)}")
            if block[at : at + 2] not in (b"n+", b"ni"):
                raise FileFault("has no NIfTI header, but Analyze's, which needs an .img beside an .hdr")
            kind(block[:length])  # raises if the header is beyond repair …
            header = kind(block[:length], check=False)  # … and would change spacings of 0 and less
            return header, block[at + 1 : at + 2] == b"+"
    raise FileFault("has no NIfTI header")


def _block(path: str) -> bytes:
    """Return the first bytes of a header, unpacked."""
    reach.check(path)  # it may be the other half of the file that was named
    with open(path, "rb") as file:
        head = file.read(2)
        file.seek(0)
        return next(unpacked(file, "deflate"), b"") if head == b"\x1f\x8b" else file.read(540)


def _axes(count: int) -> str:
    """Return letters for `pick`, slowest first: the format's axes are x, y, z, time, component, and two unnamed."""
    return "XYZTC??"[:count][::-1]


def _scaled(header: Any, values: NDArray) -> NDArray:
    slope, intercept = float(header["scl_slope"]), float(header["scl_inter"])
    if not np.isfinite(slope) or slope == 0:
        return values
    return rescaled(values, slope, intercept if np.isfinite(intercept) else 0.0)


def _times(header: Any, steps: int) -> dict[str, Any]:
    """Return the times of the steps, if the header has their distance."""
    between, unit = float(header["pixdim"][4]), _TIME_UNITS.get(int(header["xyzt_units"]) & 56)
    if steps < 2 or unit is None or not np.isfinite(between) or between <= 0:
        return {}
    start = float(header["toffset"])
    times = (start if np.isfinite(start) else 0.0) + between * np.arange(steps)
    return {"times": times.tolist(), "time_unit": unit}


def _grid(header: Any) -> dict[str, Any]:
    unit = _UNITS.get(int(header["xyzt_units"]) & 7, "")
    if int(header["sform_code"]) > 0:
        affine = header.get_sform()
    elif int(header["qform_code"]) > 0:
        affine = header.get_qform()
    else:  # method 1 of the format's definition: the grid is the world
        return {"spacing": header["pixdim"][1:4].astype(np.float64), "unit": unit}
    spacing, direction = grid_from_columns(affine[:3, :3])
    return {
        "spacing": spacing,
        "direction": direction,
        "origin": affine[:3, 3],
        "unit": unit,
        "space": "right-anterior-superior",
    }
