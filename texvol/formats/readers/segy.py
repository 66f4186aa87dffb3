"""SEG-Y: post-stack seismic traces on a grid of inlines and crosslines, read by segyio.

The volume's axes are crosslines, inlines and samples. Surveys are seldom rectangles: a place without a trace is NaN.
World x and y are the coordinates of the traces (CDP X and Y, with their scalar), in metres or feet; z is the negative
time of a sample in ms: later samples lie deeper.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.samples import Choice, FileFault, Samples, by, check_size, grid_from_columns, pick

_FEET = 2  # measurement system in the binary header
_LENGTHS = (0, 1)  # coordinate units of a trace: not told, or lengths
_FORMAT_AT, _FORMATS = 3224, 16  # byte of the code of the samples' format, and the largest code
_OFF = 0.01  # of a bin, by which traces may lie elsewhere
_SPARSEST = 10  # places of the grid for each trace
_ROUNDING = 1e-9  # of a step, in which least squares end
_AT_ONCE = 4096  # traces


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of all traces; those of a place without a trace are NaN."""
    check_survived(lambda: _described(path))
    import segyio

    with segyio.open(path, mode="r", endian=_byte_order(path), ignore_geometry=True) as file:
        places = _places(file)
        shape = (places.crosslines, places.inlines, len(file.samples))
        missing = places.crosslines * places.inlines - file.tracecount
        dtype = np.dtype(np.result_type(file.dtype, np.float32) if missing else file.dtype)
        check_size(shape, dtype.itemsize)
        pick("ZYX", shape[::-1], choice)
        values = np.full(shape[::-1], np.nan, dtype) if missing else np.empty(shape[::-1], dtype)
        for start in range(0, file.tracecount, _AT_ONCE):
            part = slice(start, start + _AT_ONCE)
            values[:, places.inline[part], places.crossline[part]] = file.trace.raw[part].T
        grid, notes = _grid(file, places)
    if missing:
        notes += (f"{missing} of {by(shape[:2])} places have no trace: their samples are NaN",)
    return Samples(values, **grid, notes=notes)


def _described(path: str) -> None:
    import segyio

    with segyio.open(path, mode="r", endian=_byte_order(path), ignore_geometry=True) as file:
        check_size((file.tracecount, len(file.samples)), 4)


def _byte_order(path: str) -> str:
    """Return the byte order by the code of the samples' format, which is at most 16: big-endian but in rare files."""
    with open(path, "rb") as file:
        file.seek(_FORMAT_AT)
        code = file.read(2)
    is_little = code[1:] == b"\0" and 1 <= code[0] <= _FORMATS
    return "little" if is_little else "big"


class _Places(NamedTuple):
    """Place of each trace on the grid, and the grid's numbers of lines."""

    inline: NDArray[np.int64]
    crossline: NDArray[np.int64]
    inlines: int
    crosslines: int


def _places(file: Any) -> _Places:
    """Return the places of all traces; raise FileFault if they are on no grid, or not stacked.

    The distance of neighbouring lines is the greatest common divisor of the distances that occur.
    """
    import segyio

    lines = [_header(file, byte) for byte in (segyio.TraceField.INLINE_3D, segyio.TraceField.CROSSLINE_3D)]
    if file.tracecount > 1 and not any(each.any() for each in lines):
        raise FileFault("its traces are not on a grid of inlines and crosslines (bytes 189 and 193 of their headers)")
    steps = [max(int(np.gcd.reduce(np.diff(np.unique(each)))) if np.ptp(each) else 1, 1) for each in lines]
    inline, crossline = ((each - each.min()) // step for each, step in zip(lines, steps, strict=True))
    inlines, crosslines = int(inline.max()) + 1, int(crossline.max()) + 1
    order = np.lexsort([crossline, inline])
    same = np.flatnonzero((np.diff(inline[order]) == 0) & (np.diff(crossline[order]) == 0))
    if same.size:
        offsets = np.unique(_header(file, segyio.TraceField.offset)).size
        if offsets > 1:
            raise FileFault(f"must be stacked, got {offsets} offsets")
        at, across = (int(each[order[same[0]]]) for each in lines)
        raise FileFault(f"must have one trace at each place, got several at inline {at}, crossline {across}")
    if inlines * crosslines > _SPARSEST * file.tracecount:
        raise FileFault(
            f"its {file.tracecount} traces are too few for a grid of {by((crosslines, inlines))} crosslines and inlines"
        )
    return _Places(inline, crossline, inlines, crosslines)


def _header(file: Any, byte: int) -> NDArray[np.int64]:
    """Return a field of the headers of all traces."""
    return np.asarray(file.attributes(byte)[:], np.int64)


def _grid(file: Any, places: _Places) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the grid of the traces' coordinates and the samples' times, and notes."""
    times = np.asarray(file.samples, np.float64)
    step = float(times[1] - times[0]) if len(times) > 1 else 1.0
    notes = ["the third axis is time in ms, downwards; --spacing X,Y,Z scales it to depth"]
    length = "ft" if int(file.bin[3255]) == _FEET else "m"
    coordinates = _coordinates(file)
    if coordinates is None:
        columns, origin = np.diag([1.0, 1.0, -step]), np.array([0, 0, 0.0 - times[0]])
        space = "crossline, inline, -time (ms)"
        notes.append("its traces have no coordinates in lengths: crosslines and inlines are 1 apart")
    else:
        first, x, y, off = _fitted(coordinates, places)
        if off > _OFF * max(np.abs([x, y]).max(), 1e-9) + 1:
            notes.append(f"the coordinates of its traces are on no even grid: the nearest one is up to {off:.3g} away")
        columns = np.array([[x[0], y[0], 0], [x[1], y[1], 0], [0, 0, -step]])
        origin, space = np.array([*first, 0.0 - times[0]]), f"x ({length}), y ({length}), -time (ms)"
    spacing, direction = grid_from_columns(columns)
    return {"spacing": spacing, "direction": direction, "origin": origin, "space": space}, tuple(notes)


def _fitted(
    coordinates: NDArray[np.float64], places: _Places
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float]:
    """Return the origin and the steps of both kinds of lines by least squares, and the largest distance from them."""
    is_known = coordinates.any(axis=1)  # of some traces they may be left 0
    crossline, inline, coordinates = places.crossline[is_known], places.inline[is_known], coordinates[is_known]
    middle = coordinates.mean(axis=0)  # coordinates have more digits than their differences
    terms = np.column_stack([np.ones(len(coordinates)), crossline, inline]).astype(np.float64)
    found = np.linalg.lstsq(terms, coordinates - middle, rcond=None)[0]
    found[1:][np.abs(found[1:]) < _ROUNDING * np.abs(found[1:]).max(initial=0)] = 0
    off = float(np.abs(terms @ found - (coordinates - middle)).max())
    # Of a single line the other direction has no step.
    x, y = (found[number] * (count > 1) for number, count in ((1, places.crosslines), (2, places.inlines)))
    return (found[0] + middle, *_completed(x, y), off)


def _completed(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return both steps; one that is 0, of a single line, becomes the other one turned by a right angle."""
    if not x.any() and not y.any():
        return np.array([1.0, 0.0]), np.array([0.0, 1.0])
    if not x.any():
        x = np.array([y[1], -y[0]])
    if not y.any():
        y = np.array([-x[1], x[0]])
    return x, y


def _coordinates(file: Any) -> NDArray[np.float64] | None:
    """Return the coordinates of all traces, shape (n, 2); None without any."""
    import segyio

    fields = segyio.TraceField
    if not np.isin(_header(file, fields.CoordinateUnits), _LENGTHS).all():
        return None
    scalars = _header(file, fields.SourceGroupScalar).astype(np.float64)
    factors = np.where(scalars > 0, scalars, 1 / np.where(scalars < 0, -scalars, 1.0))
    places = [_header(file, each).astype(np.float64) for each in (fields.CDP_X, fields.CDP_Y)]
    found = np.column_stack(places) * factors[:, np.newaxis]
    return found if found.any() else None
