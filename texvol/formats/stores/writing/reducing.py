"""Coarser samples of a pyramid, means or the most frequent labels, and statistics of chunks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import Triple

Numbers = NDArray[np.float64]


def reduced(values: NDArray, factor: Triple, labels: bool) -> NDArray:
    """Return samples of which each stands for a box of `factor` samples (z, y, x), fewer at the end of odd numbers.

    Means are of the samples that are there, NaN aside; those of integers are rounded, half to even. Of labels it is the
    most frequent one, of equally frequent ones the smallest.
    """
    return _most_frequent(values, factor) if labels else _mean(values, factor)


def _mean(values: NDArray, factor: Triple) -> NDArray:
    if values.dtype.kind == "f":
        known = ~np.isnan(values)
        with np.errstate(invalid="ignore", over="ignore"):
            total = _sums(np.where(known, values, 0).astype(np.float64), factor)
            mean = np.divide(total, _sums(known.astype(np.float64), factor))
        return mean.astype(values.dtype)
    exact = np.int32 if values.dtype.itemsize <= 2 else np.float64
    total, count = _sums(values.astype(exact), factor), _counts(values.shape, factor)
    mean = np.rint(total / count)
    if values.dtype.itemsize == 8:
        # Beyond 2^53 a float64 may be past the largest integer.
        ends = np.iinfo(values.dtype)
        return np.where(mean >= float(ends.max), ends.max, np.clip(mean, ends.min, ends.max).astype(values.dtype))
    return mean.astype(values.dtype)


def _sums(values: NDArray, factor: Triple) -> NDArray:
    for axis, step in enumerate(factor):
        if step > 1:
            values = np.add.reduceat(values, np.arange(0, values.shape[axis], step), axis=axis)
    return values


def _counts(shape: tuple[int, ...], factor: Triple) -> Numbers:
    """Numbers of samples in each box."""
    axes = [
        np.minimum(step, count - np.arange(0, count, step)).astype(np.float64)
        for count, step in zip(shape, factor, strict=True)
    ]
    return axes[0][:, np.newaxis, np.newaxis] * axes[1][:, np.newaxis] * axes[2]


def _most_frequent(values: NDArray, factor: Triple) -> NDArray:
    # At the end of odd numbers the last samples stand twice, which leaves the most frequent one as it is.
    pad = [(0, -count % step) for count, step in zip(values.shape, factor, strict=True)]
    values = np.pad(values, pad, mode="edge")
    corners = [values[i :: factor[0], j :: factor[1], k :: factor[2]] for i, j, k in np.ndindex(*factor)]
    ordered = np.sort(np.stack(corners), axis=0)
    often = np.stack([(ordered == each).sum(axis=0, dtype=np.uint8) for each in ordered])
    first = often.argmax(axis=0)[np.newaxis]
    return np.asarray(np.take_along_axis(ordered, first, axis=0)[0])


def statistics(values: NDArray, margin: tuple[Triple, Triple], chunk: Triple) -> tuple[Numbers, ...]:
    """Return minimum, maximum, variance, and the extremes with the next samples around, of each chunk of a box.

    Parameters
    ----------
    values : array of shape (nz, ny, nx)
        The box, and the next sample on each side that has one.
    margin : ((z, y, x), (z, y, x))
        Numbers of samples before and after the box, 0 or 1.
    chunk : (z, y, x)

    Returns
    -------
    Five arrays of shape (cz, cy, cx); NaN where all samples are NaN. The variance is NaN beside infinite values.
    """
    inner = values[tuple(slice(a, n - b) for a, b, n in zip(*margin, values.shape, strict=True))]
    starts = [np.arange(0, count, size) for count, size in zip(inner.shape, chunk, strict=True)]
    found = np.full((5, *map(len, starts)), np.nan)
    for position in np.ndindex(*found.shape[1:]):
        low = [int(each[i]) for each, i in zip(starts, position, strict=True)]
        high = [min(a + size, count) for a, size, count in zip(low, chunk, inner.shape, strict=True)]
        own = inner[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
        around = values[
            tuple(slice(max(a + m - 1, 0), b + m + 1) for a, b, m in zip(low, high, margin[0], strict=True))
        ]
        found[(slice(0, 3), *position)] = _of_chunk(own)
        found[(slice(3, 5), *position)] = _extremes(around)
    return tuple(found)


def _of_chunk(values: NDArray) -> tuple[float, float, float]:
    low, high = _extremes(values)
    if not np.isfinite([low, high]).all():
        return low, high, float("nan")
    numbers = values.astype(np.float64).reshape(-1)
    numbers = numbers[~np.isnan(numbers)] if values.dtype.kind == "f" else numbers
    return low, high, float(numbers.var())


def _extremes(values: NDArray) -> tuple[float, float]:
    if values.dtype.kind != "f":
        return float(values.min()), float(values.max())
    if np.isnan(values).all():
        return float("nan"), float("nan")
    return float(np.fmin.reduce(values, axis=None)), float(np.fmax.reduce(values, axis=None))
