"""SEG-Y: post-stack seismic traces on a grid of inlines and crosslines, read by segyio.

The volume's axes are crosslines, inlines and samples. World x and y are the coordinates of the traces (CDP X and Y,
with their scalar), in metres or feet; z is the time of a sample in ms, which runs downwards in the earth.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.samples import Choice, FileFault, Samples, by, check_size, grid_from_columns, pick

_FEET = 2  # measurement system in the binary header
_LENGTHS = (0, 1)  # coordinate units of a trace: not told, or lengths
_FORMAT_AT, _FORMATS = 3224, 16  # byte of the code of the samples' format, and the largest code
_OFF = 0.01  # of a bin, by which the far corner may lie elsewhere


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of all traces."""
    check_survived(lambda: _described(path))
    import segyio

    with segyio.open(path, mode="r", endian=_byte_order(path)) as file:
        shape = _shape(path, file)
        pick("ZYX", shape[::-1], choice)
        traces = np.asarray(file.trace.raw[:])
        if _is_by_inlines(file):
            planes = traces.reshape(shape[1], shape[0], shape[2])
        else:
            planes = traces.reshape(shape).swapaxes(0, 1)
        values = np.ascontiguousarray(np.moveaxis(planes, 2, 0))
        grid, notes = _grid(file, shape)
    return Samples(values, **grid, notes=notes)


def _described(path: str) -> None:
    import segyio

    with segyio.open(path, mode="r", endian=_byte_order(path)) as file:
        _shape(path, file)


def _byte_order(path: str) -> str:
    """Return the byte order by the code of the samples' format, which is at most 16: big-endian but in rare files."""
    with open(path, "rb") as file:
        file.seek(_FORMAT_AT)
        code = file.read(2)
    is_little = code[1:] == b"\0" and 1 <= code[0] <= _FORMATS
    return "little" if is_little else "big"


def _shape(path: str, file: Any) -> tuple[int, int, int]:
    """Return the numbers of crosslines, inlines and samples; raise FileFault if traces are on no such grid."""
    if file.unstructured or file.ilines is None:
        raise FileFault("its traces are not on a grid of inlines and crosslines (bytes 189 and 193 of their headers)")
    if len(file.offsets) != 1:
        raise FileFault(f"must be stacked, got {len(file.offsets)} offsets")
    shape = (len(file.xlines), len(file.ilines), len(file.samples))
    needed = check_size(shape, 4)
    if shape[0] * shape[1] != file.tracecount:
        raise FileFault(f"must have a trace for each of {by(shape[:2])} crosslines and inlines, got {file.tracecount}")
    if needed > 4 * os.path.getsize(path):  # samples take a byte or more
        raise FileFault(f"holds {os.path.getsize(path)} bytes, but its {by(shape)} samples need {needed}")
    return shape


def _is_by_inlines(file: Any) -> bool:
    """True if the traces of an inline follow each other."""
    import segyio

    return bool(file.sorting == segyio.TraceSortingFormat.INLINE_SORTING)


def _grid(file: Any, shape: tuple[int, int, int]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the grid of the traces' coordinates and the samples' times, and notes."""
    times = np.asarray(file.samples, np.float64)
    step = float(times[1] - times[0]) if len(times) > 1 else 1.0
    corners = _corners(file, shape)
    notes = ["the third axis is time in ms, downwards; --spacing X,Y,Z scales it to depth"]
    length = "ft" if int(file.bin[3255]) == _FEET else "m"
    if corners is None:
        columns, origin, space = np.diag([1.0, 1.0, step]), np.array([0, 0, times[0]]), "crossline, inline, time (ms)"
        notes.append("its traces have no coordinates in lengths: crosslines and inlines are 1 apart")
    else:
        first, along, across, far = corners
        x = (along - first) / max(shape[0] - 1, 1)
        y = (across - first) / max(shape[1] - 1, 1)
        x, y = _completed(x, y)
        if (
            np.abs(first + x * (shape[0] - 1) + y * (shape[1] - 1) - far).max()
            > _OFF * max(np.abs([x, y]).max(), 1e-9) + 1
        ):
            notes.append("the coordinates of its traces are no parallelogram: those of three corners are taken")
        columns = np.array([[x[0], y[0], 0], [x[1], y[1], 0], [0, 0, step]])
        origin, space = np.array([*first, times[0]]), f"x ({length}), y ({length}), time (ms)"
    spacing, direction = grid_from_columns(columns)
    return {"spacing": spacing, "direction": direction, "origin": origin, "space": space}, tuple(notes)


def _completed(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return both steps; one that is 0, of a single line, becomes the other one turned by a right angle."""
    if not x.any() and not y.any():
        return np.array([1.0, 0.0]), np.array([0.0, 1.0])
    if not x.any():
        x = np.array([y[1], -y[0]])
    if not y.any():
        y = np.array([-x[1], x[0]])
    return x, y


def _corners(file: Any, shape: tuple[int, int, int]) -> list[NDArray[np.float64]] | None:
    """Return the coordinates of the first trace, the last crossline, the last inline, and both; None without any."""
    import segyio

    fields = segyio.TraceField
    found = []
    for inline, crossline in ((0, 0), (0, shape[0] - 1), (shape[1] - 1, 0), (shape[1] - 1, shape[0] - 1)):
        number = inline * shape[0] + crossline if _is_by_inlines(file) else crossline * shape[1] + inline
        header = file.header[number]
        scalar = int(header[fields.SourceGroupScalar])
        factor = float(scalar) if scalar > 0 else 1.0 / -scalar if scalar < 0 else 1.0
        if int(header[fields.CoordinateUnits]) not in _LENGTHS:
            return None
        found.append(np.array([float(header[fields.CDP_X]), float(header[fields.CDP_Y])]) * factor)
    return found if any(each.any() for each in found) else None
