"""Variances that coarse levels leave out, from a level that is in memory: the guide.

Let g be the level of the guide. The store's statistics tell the variance a below each of its samples, as they do where
matter is classified by its distribution. What a level l > g leaves out beside that is measured: the guide is averaged
to the samples of level l, interpolated back and subtracted. For the levels between, variances are taken to grow by the
same factor r from each to the next,

    a = d (1 + r + … + r^(g-1)),    b = d r^g

with b that which the next level beyond the guide leaves out. A variance is that of values beside interpolated ones. Of
a field that is linear from sample to sample all of it is b / 4 below the guide, and interpolation brings that back as
well as it brings b back.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import LargeVolume
from texvol.scene.volume import Volume
from texvol.textures.distribution import Smoothed

Numbers = NDArray[np.float64]
Floats = NDArray[np.float32]
_LINEAR = 4.0  # times the variance of a linear function within samples twice as long
_LEAST_GROWTH, _MOST_GROWTH = 0.125, 4.0  # of noise without any structure, and of linear functions


@dataclass(frozen=True)
class Guide:
    """A level of a large volume in memory, whose samples stand for distributions of values."""

    volume: LargeVolume
    number: int
    samples: Volume
    function: Smoothed

    @classmethod
    def of(cls, volume: LargeVolume, function: Smoothed) -> Guide | None:
        """Return the guide that has been read for an overview; None if that is no coarse level, or not all of one."""
        number = volume.level_in_memory
        return cls(volume, number, volume.overview, function) if number else None

    @cached_property
    def means(self) -> Floats:
        """Values of its samples, shape (nz, ny, nx); the least one where none is known."""
        low, high = self.function.ends
        values = self.samples.values.astype(np.float32)
        return np.clip(np.nan_to_num(values, nan=low, posinf=high, neginf=low), low, high)

    @cached_property
    def below(self) -> Floats:
        """Variance of the values that each sample stands for: what chunks vary more than the guide does in them."""
        statistics, level = self.volume.levels[0].statistics, self.volume.levels[self.number]
        assert statistics is not None
        chunks: list[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]] = []
        for axis, (length, count) in enumerate(zip(statistics.chunk_shape, statistics.variance.shape, strict=True)):
            at = level.first[2 - axis] + level.factor[2 - axis] * np.arange(self.means.shape[axis])
            number = np.clip(np.floor((at + 0.5) / length), 0, count - 1).astype(np.intp)
            starts = np.flatnonzero(np.diff(number, prepend=-1))
            chunks.append((number[starts], starts, np.diff(starts, append=len(number))))
        numbers, starts, counts = ([each[k] for each in chunks] for k in range(3))
        above, _ = self._averaged(self.number + 1)
        where = np.ix_(*numbers)
        means = self.means - self.means.mean(dtype=np.float64)
        varies = _means(means**2, starts, counts) - _means(means, starts, counts) ** 2
        lost = np.maximum(np.nan_to_num(statistics.variance[where]) - varies, 0)
        of_chunks = _means(above, starts, counts)
        share = np.divide(lost, of_chunks, out=np.zeros_like(lost), where=of_chunks > 0)
        most = np.nan_to_num((statistics.maximum[where] - statistics.minimum[where]) ** 2 / 4)
        shared = np.minimum(above * _repeated(share, counts), _repeated(most, counts))
        return np.asarray(np.maximum(shared, above / _LINEAR), np.float32)

    def left_out(self, number: int) -> Floats:
        """Return the variance of values beside those that a coarse level interpolates, for each sample of the guide."""
        above, beside = self._averaged(self.number + 1)
        kept = np.divide(beside, above, out=np.ones_like(above), where=above > 0)
        linear = np.minimum(self.below, above / _LINEAR)
        unknown = np.minimum(kept, 1.0) * linear + (self.below - linear)
        if number < self.number:
            return unknown * self._fractions(number, above)
        return unknown if number == self.number else unknown + self._averaged(number)[1]

    def _fractions(self, number: int, above: Floats) -> Floats:
        """Return which fraction of the variance below the guide a finer level leaves out."""
        growths = np.geomspace(_LEAST_GROWTH, _MOST_GROWTH, 64)
        sums = np.array([(growths**k) for k in range(self.number)]).cumsum(axis=0)
        ratios = growths**self.number / sums[-1]
        found = np.divide(above, self.below, out=np.full_like(above, np.inf), where=self.below > 0)
        return np.interp(found, ratios, sums[number - 1] / sums[-1]).astype(np.float32)

    def _averaged(self, number: int) -> tuple[Floats, Floats]:
        """Return what the guide varies within samples of a coarser level, and beside values between these."""
        if number not in self._known:
            finest = np.array(self.volume.levels[self.number].factor)
            if number < len(self.volume.levels):
                factor = np.maximum(np.rint(np.array(self.volume.levels[number].factor) / finest), 1).astype(int)
            else:
                factor = np.array([2, 2, 2])
            means, starts = self.means, []
            counts = []
            for axis, step in enumerate(factor[::-1]):
                starts.append(np.arange(0, means.shape[axis], step))
                counts.append(np.diff(starts[-1], append=means.shape[axis]))
            coarse = _means(self.means, starts, counts)
            interpolated = coarse
            for axis, (start, count) in enumerate(zip(starts, counts, strict=True)):
                interpolated = _between(interpolated, axis, start + (count - 1) / 2, means.shape[axis])
            within = _means((means - means.mean()) ** 2, starts, counts) - (coarse - means.mean()) ** 2
            beside = _means((means - interpolated) ** 2, starts, counts)
            self._known[number] = _repeated(np.maximum(within, 0), counts), _repeated(beside, counts)
        return self._known[number]

    @cached_property
    def _known(self) -> dict[int, tuple[Floats, Floats]]:
        return {}


def _means(values: Floats, starts: list[NDArray], counts: list[NDArray]) -> Numbers:
    for axis, (start, count) in enumerate(zip(starts, counts, strict=True)):
        shape = [-1 if each == axis else 1 for each in range(3)]
        values = np.add.reduceat(values, start, axis=axis, dtype=np.float64) / count.reshape(shape)
    return values


def _repeated(values: Floats, counts: list[NDArray]) -> Floats:
    for axis, count in enumerate(counts):
        values = np.repeat(values, count, axis=axis)
    return values


def _between(values: Floats, axis: int, places: Numbers, count: int) -> Floats:
    """Return values at places along an axis interpolated at 0, 1, … count - 1."""
    at = np.interp(np.arange(count), places, np.arange(len(places)))
    low = np.minimum(at.astype(int), max(len(places) - 2, 0))
    high = np.minimum(low + 1, len(places) - 1)
    part = (at - low).astype(np.float32).reshape([-1 if each == axis else 1 for each in range(3)])
    return (1 - part) * np.take(values, low, axis) + part * np.take(values, high, axis)
