"""Samples of a box with their neighbours, as floating-point numbers, and which of them are there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Neighbourhood:
    """A box of samples and `reach` more on each side, axes z, y, x."""

    # Finite. Beyond the border of the volume its outermost samples go on; a missing or infinite sample is 0.
    values: NDArray[np.floating]
    # True for samples of the volume that are finite; None where only those beyond the border are not.
    there: NDArray[np.bool_] | None
    starts: tuple[int, ...]  # first sample of the box
    counts: tuple[int, ...]  # samples of the volume
    reach: int

    @classmethod
    def of(
        cls,
        samples: NDArray,
        box: tuple[tuple[int, int], ...],
        reach: int,
        dtype: np.dtype,
        scale: float,
        labels: bool = False,
    ) -> Neighbourhood:
        """Read a box, given as first sample and one past the last along z, y, x, and multiply it with `scale`.

        Of `labels` it is 1 where there is one, and 0 where there is none.
        """
        starts = tuple(start for start, _ in box)
        counts = samples.shape
        ends = [
            (max(start - reach, 0), min(stop + reach, count)) for (start, stop), count in zip(box, counts, strict=True)
        ]
        inner = tuple(
            slice(low - start + reach, high - start + reach) for (low, high), start in zip(ends, starts, strict=True)
        )
        shape = tuple(stop - start + 2 * reach for start, stop in box)
        read = samples[tuple(slice(low, high) for low, high in ends)]
        if labels:
            read = read != 0
        values = np.empty(shape, dtype)
        values[inner] = read
        there = None
        if read.dtype.kind == "f" and not (finite := np.isfinite(read)).all():
            there = np.zeros(shape, np.bool_)
            there[inner] = finite
            values[inner][~finite] = 0
        if scale != 1:
            values[inner] *= scale
        for axis, part in enumerate(inner):
            values[along(axis, 0, part.start)] = values[along(axis, part.start, part.start + 1)]
            values[along(axis, part.stop, shape[axis])] = values[along(axis, part.stop - 1, part.stop)]
        return cls(values, there, starts, counts, reach)

    def crop(self, numbers: NDArray, reach: int, axis: int | None = None) -> NDArray:
        """A part of `values` or `there` that goes `reach` beyond the box, and along `axis` all the way."""
        cut = self.reach - reach
        return numbers[
            tuple(slice(None) if a == axis else slice(cut, size - cut) for a, size in enumerate(numbers.shape))
        ]

    def positions(self, axis: int) -> NDArray[np.intp]:
        """Index in the volume of each of `values` along an axis; beyond the border it goes on."""
        start = self.starts[axis] - self.reach
        return np.arange(start, start + self.values.shape[axis])

    def inside(self, axis: int) -> NDArray[np.bool_]:
        """True for each of `values` along an axis that is a sample of the volume."""
        positions = self.positions(axis)
        return (positions >= 0) & (positions < self.counts[axis])


def along(axis: int, start: int, stop: int) -> tuple[slice, ...]:
    """Index of a part of an array along one of its axes."""
    return (*(slice(None),) * axis, slice(start, stop))


def vector_along(axis: int, numbers: NDArray) -> NDArray:
    """Numbers of shape (n,) laid along one of three axes."""
    return numbers.reshape([-1 if a == axis else 1 for a in range(3)])
