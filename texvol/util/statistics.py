"""Order statistics as in numpy and the standard library, without their slow imports.

np.unique and np.percentile import numpy.ma, and the standard library's median imports decimal: together 16 ms of the
600 ms that a picture from the command line takes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

_CHUNK = 2**20
_LARGEST = 4e307  # twice this is still a number
_SMALLEST = 1e-290  # bins over the width of numbers that are smaller overflow
_ON_A_STEP = 1e-3  # steps, with 16 bits: float32 resolves a 256th of a step of numbers as large as the range


def distinct(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distinct numbers in ascending order, shape (n,); none may be NaN."""
    ordered = np.sort(numbers, axis=None)
    return ordered[np.append(True, ordered[1:] != ordered[:-1])[: ordered.size]]


def percentile_of_sorted(numbers: NDArray[np.float64], percent: ArrayLike) -> NDArray[np.float64]:
    """Return np.percentile of ascending numbers, shape (n,), without NaN; the result has the shape of `percent`."""
    position = np.asarray(percent, np.float64) / 100 * (numbers.size - 1)
    before = np.floor(position).astype(np.intp)
    low, high = numbers[before], numbers[np.minimum(before + 1, numbers.size - 1)]
    fraction, rise = position - before, high - low
    # From the nearer end, so that fractions 0 and 1 give the ends exactly.
    return np.asarray(np.where(fraction < 0.5, low + rise * fraction, high - rise * (1 - fraction)))


def median(numbers: Sequence[float]) -> float:
    """Return the middle number, or the mean of the two middle numbers, of at least one number."""
    ordered = sorted(numbers)
    return 0.5 * (ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2])


def histogram(
    numbers: NDArray[np.float64], bins: int, ends: tuple[float, float]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return counts and edges of even bins between two ends, wider where float64 has too few numbers between them."""
    low, high = max(ends[0], -_LARGEST), min(ends[1], _LARGEST)
    narrowest = 2 * bins * float(np.spacing(max(abs(low), abs(high), _SMALLEST)))
    if high - low < narrowest:
        room = narrowest if high > low else max(narrowest, 0.5)
        low, high = low - room, high + room
    return np.histogram(numbers, bins, (low, high))


def chunks(numbers: NDArray) -> Iterator[NDArray]:
    """Yield parts of at most 2^20 numbers, flat and in order, so that what is made of each stays small."""
    flat = numbers.reshape(-1)
    for begin in range(0, flat.size, _CHUNK):
        yield flat[begin : begin + _CHUNK]


def finite(numbers: NDArray) -> NDArray:
    """Return the numbers that are neither NaN nor infinite; integers are not copied."""
    return numbers if numbers.dtype.kind != "f" else numbers[np.isfinite(numbers)]


def rms(numbers: NDArray) -> float:
    """Return the root mean square of all numbers."""
    return float(np.sqrt(np.square(numbers).mean()))


def on_steps(values: NDArray, first: float, apart: float) -> NDArray:
    """Return values rounded to steps; a value already on a step is not changed by rounding errors of this function."""
    steps = (values - first) / apart
    off = np.rint(steps) - steps
    return values + np.where(np.abs(off) > _ON_A_STEP, off, 0) * apart
