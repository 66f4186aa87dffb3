"""AFNI: a `.HEAD` of text, read by nibabel, and samples in the `.BRIK` beside it.

World coordinates are RAS+ as nibabel has them: AFNI's own, with x and y the other way. Sub-bricks are time steps where
the header has a time axis, else channels, of which the first is read unless one is chosen.
"""

from __future__ import annotations

import io
import os
import sys
from typing import Any

import numpy as np

from texvol.formats.readers.channels import with_first
from texvol.formats.readers.samples import Choice, FileFault, Samples, grid_from_columns, pick, real_type, rescaled
from texvol.formats.readers.stored import Stored, encoding_of, read_picked
from texvol.util import reach

_MOST_BYTES = 16 << 20  # of a header
_MOST_NAMED = 12
_TIME_UNITS = {77001: "ms", 77002: "s", 77003: "Hz"}  # AFNI's codes


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of a dataset by the name of its `.HEAD` or `.BRIK`."""
    header_path, data_path = _pair(path)
    header = _header(header_path)
    sizes = [int(size) for size in header.get_data_shape()]
    if not 3 <= len(sizes) <= 4:
        raise FileFault(f"must have three axes and sub-bricks, got {len(sizes)} axes")
    is_time = "TAXIS_NUMS" in header.info
    axes = ("T" if is_time else "C") * (len(sizes) - 3) + "ZYX"
    choice = with_first(axes, sizes[::-1], choice)
    index = pick(axes, sizes[::-1], choice)
    dtype = real_type(np.dtype(header.get_data_dtype()))
    values = read_picked(Stored(data_path, dtype, tuple(sizes[::-1]), encoding_of(data_path)), index, choice)
    chosen = index[0] if len(sizes) > 3 and isinstance(index[0], int) else 0
    slopes = header.get_data_scaling()
    slope = 1.0 if slopes is None else float(np.ravel(slopes)[chosen])
    if slope not in (0.0, 1.0):  # 0: none
        values = rescaled(values, slope, 0.0)
    spacing, direction = grid_from_columns((affine := header.get_affine())[:3, :3])
    grid: dict[str, Any] = {"spacing": spacing, "direction": direction, "origin": affine[:3, 3]}
    times = _times(header, sizes[3]) if is_time and len(sizes) > 3 else {}
    notes = _notes(header, chosen, sizes[3] if axes[0] == "C" else 1)
    return Samples(values, **grid, unit="mm", space="right-anterior-superior", notes=notes, **times)


def _pair(path: str) -> tuple[str, str]:
    """Return the paths of header and samples."""
    lower = path.lower()
    ending = next(each for each in (".head", ".brik.gz", ".brik.bz2", ".brik") if lower.endswith(each))
    stem = path[: -len(ending)]
    header = next((stem + each for each in (".HEAD", ".head") if os.path.isfile(stem + each)), "")
    if not header:
        raise FileFault(f"is half of an AFNI dataset: {os.path.basename(stem)}.HEAD must be beside it")
    if ending != ".head":
        return header, path
    endings = [ending + packed for packed in ("", ".gz", ".bz2") for ending in (".BRIK", ".brik")]
    samples = next((stem + each for each in endings if os.path.isfile(stem + each)), "")
    if not samples:
        raise FileFault(f"is half of an AFNI dataset: {os.path.basename(stem)}.BRIK must be beside it")
    return header, samples


def _header(path: str) -> Any:
    from nibabel.brikhead import AFNIHeader, parse_AFNI_header

    if os.path.getsize(path) > _MOST_BYTES:
        raise FileFault(f"its header must have at most {_MOST_BYTES} bytes, got {os.path.getsize(path)}")
    reach.check(path)
    with open(path, encoding="latin-1") as file:
        text = file.read()
    info = parse_AFNI_header(io.StringIO(text))
    for key in ("DATASET_DIMENSIONS", "DATASET_RANK", "BRICK_TYPES", "ORIENT_SPECIFIC", "ORIGIN", "DELTA"):
        if key not in info:
            raise FileFault(f"its header has no {key}")
    info.setdefault("BYTEORDER_STRING", "LSB_FIRST" if sys.byteorder == "little" else "MSB_FIRST")
    if "IJK_TO_DICOM_REAL" not in info:  # of programs before 2005, whose axes are straight
        info["IJK_TO_DICOM_REAL"] = _straight(info)
    return AFNIHeader(info)


def _straight(info: dict[str, Any]) -> list[float]:
    """Return the matrix, 3 rows of 4, of axes along those of the world."""
    matrix = np.zeros((3, 4))
    codes, origin, steps = (np.ravel(info[key])[:3] for key in ("ORIENT_SPECIFIC", "ORIGIN", "DELTA"))
    for axis, (code, start, step) in enumerate(zip(codes, origin, steps, strict=True)):
        if not 0 <= int(code) < 6:
            raise FileFault(f"ORIENT_SPECIFIC must be three numbers from 0 to 5, got {list(codes)}")
        matrix[int(code) // 2, axis], matrix[int(code) // 2, 3] = float(step), float(start)
    return matrix.ravel().tolist()


def _times(header: Any, steps: int) -> dict[str, Any]:
    """Return the times of the steps, if the header has their distance."""
    floats, numbers = header.info.get("TAXIS_FLOATS", []), header.info["TAXIS_NUMS"]
    unit = _TIME_UNITS.get(int(numbers[2])) if isinstance(numbers, list) and len(numbers) > 2 else None
    if not isinstance(floats, list) or len(floats) < 2 or unit is None or not 0 < float(floats[1]) < np.inf:
        return {}
    return {"times": (float(floats[0]) + float(floats[1]) * np.arange(steps)).tolist(), "time_unit": unit}


def _notes(header: Any, chosen: int, among: int) -> tuple[str, ...]:
    """Return a note with the name of the sub-brick, and with those among which `--channel` chooses."""
    names = dict(enumerate(each.strip() for each in str(header.info.get("BRICK_LABS", "")).split("~")))
    if among < 2:
        return (f"sub-brick {chosen}: {names[chosen]}",) if names.get(chosen) else ()
    listed = ", ".join(f"{number} {names.get(number, '')}".strip() for number in range(min(among, _MOST_NAMED)))
    listed += ", …" if among > _MOST_NAMED else ""
    own = f"{chosen} {names.get(chosen, '')}".strip()
    return (f"sub-brick {own} of {among}: {listed}; --channel N chooses",)
