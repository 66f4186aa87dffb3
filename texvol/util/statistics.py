"""Numbers by their rank, as numpy and the standard library have them, but without what those import for it.

np.unique and np.percentile import numpy.ma, and the standard library's median decimal arithmetic: together 16 ms of a
picture from the command line, which takes 600.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

_ON_A_STEP = 1e-3  # of 16 bits: float32 leaves a 256th of a step of numbers as large as the range


def distinct(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each of them once, from the least to the largest, shape (n,); none is NaN."""
    ordered = np.sort(numbers, axis=None)
    return ordered[np.append(True, ordered[1:] != ordered[:-1])[: ordered.size]]


def percentile_of_sorted(numbers: NDArray[np.float64], percent: ArrayLike) -> NDArray[np.float64]:
    """np.percentile of numbers in ascending order, shape (n,), of which none is NaN; of the shape of `percent`."""
    position = np.asarray(percent, np.float64) / 100 * (numbers.size - 1)
    before = np.floor(position).astype(np.intp)
    low, high = numbers[before], numbers[np.minimum(before + 1, numbers.size - 1)]
    fraction, rise = position - before, high - low
    # From the nearer end, so that it is that end itself at a share of 0 or 1.
    return np.asarray(np.where(fraction < 0.5, low + rise * fraction, high - rise * (1 - fraction)))


def median(numbers: Sequence[float]) -> float:
    """The middle one, or the mean of the two in the middle; there is one at least."""
    ordered = sorted(numbers)
    return 0.5 * (ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2])


def rms(numbers: NDArray) -> float:
    """Root mean square of all numbers."""
    return float(np.sqrt(np.square(numbers).mean()))


def on_steps(values: NDArray, first: float, apart: float) -> NDArray:
    """Values rounded to steps; what lies on one stays as it is, and is not moved by the rounding of these lines."""
    steps = (values - first) / apart
    off = np.rint(steps) - steps
    return values + np.where(np.abs(off) > _ON_A_STEP, off, 0) * apart
