"""Variances that coarse levels leave out, from a level that is in memory: the guide.

Let g be the level of the guide. The store's statistics tell the variance a below each of its samples, as they do where
matter is classified by its distribution. What a level l > g leaves out beside that is measured: the guide is averaged
to the samples of level l, interpolated back and subtracted. For the levels between, variances are taken to grow by the
same factor r from each to the next,

    a = d (1 + r + … + r^(g-1)),    b = d r^g

with b that which the next level beyond the guide leaves out. A variance is that of values beside interpolated ones. Of
a field that is linear from sample to sample all of it is b / 4 below the guide, and interpolation brings that back as
well as it brings b back.

A step between two samples of the guide varies within none of them. Interpolated it is as long as they lie apart, and
really as short as a sample of level 0, so that a step of Δ leaves out Δ² / 48 in both: each bends the guide by Δ there.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import LargeVolume
from texvol.scene.volume import Volume
from texvol.textures.distribution import Smoothed

Numbers = NDArray[np.float64]
Floats = NDArray[np.float32]
Integers = NDArray[np.intp]
_LINEAR = 4.0  # times the variance of a linear function within samples twice as long
_STEP = 48.0  # see above: interpolated between samples it is off by Δ / 4 at most, on either side
_LEAST_GROWTH, _MOST_GROWTH = 0.125, 4.0  # of noise without any structure, and of linear functions
_GROWTHS = 64  # that are tried
_HALVED = (2.0, 2.0, 2.0)


@dataclass(frozen=True)
class Runs:
    """Runs of samples along an axis: where each begins, and how many samples it has."""

    starts: Integers
    counts: Integers

    @classmethod
    def of(cls, starts: Integers, samples: int) -> Runs:
        """Return the runs that begin at some samples, of so many in all."""
        return cls(starts, np.diff(starts, append=samples))

    @property
    def middles(self) -> Numbers:
        """Middle of each, in samples."""
        return self.starts + (self.counts - 1) / 2


@dataclass(frozen=True)
class Guide:
    """A level of a large volume in memory, whose samples stand for distributions of values.

    Values are fractions of the range of the transfer function, and variances squares of such.
    """

    volume: LargeVolume
    number: int
    samples: Volume
    function: Smoothed
    _known: dict[int, tuple[Floats, Floats]] = field(default_factory=dict)

    @classmethod
    def of(cls, volume: LargeVolume, function: Smoothed) -> Guide | None:
        """Return the guide that has been read for an overview; None if that is no coarse level, or not all of one."""
        number = volume.level_in_memory
        return cls(volume, number, volume.overview, function) if number else None

    @cached_property
    def means(self) -> Floats:
        """Values of its samples above the table's least, shape (nz, ny, nx); what is missing is like the least."""
        low, high = self.function.ends
        values = np.nan_to_num(self.samples.values.astype(np.float64), nan=low, posinf=high, neginf=low)
        return ((np.clip(values, low, high) - low) / self.function.range).astype(np.float32)

    @cached_property
    def below(self) -> Floats:
        """Variance of the values that each sample stands for: what chunks vary more than the guide does in them."""
        statistics = self.volume.levels[0].statistics
        assert statistics is not None
        numbers, chunks = self._chunks(statistics.chunk_shape, statistics.variance.shape)
        where, unit = np.ix_(*numbers), self.function.range
        with np.errstate(over="ignore", invalid="ignore"):
            variances = np.nan_to_num(statistics.variance[where] / unit / unit)
            most = np.nan_to_num(((statistics.maximum[where] - statistics.minimum[where]) / unit) ** 2 / 4)
        varies = _means(self.means**2, chunks) - _means(self.means, chunks) ** 2
        lost = np.maximum(variances - varies, 0)
        # Shared out by how much the guide varies from sample to sample.
        above, _ = self._averaged(self.number + 1)
        of_chunks = _means(above, chunks)
        share = np.divide(lost, of_chunks, out=np.zeros_like(lost), where=of_chunks > 0)
        shared = np.minimum(above * _repeated(share, chunks), _repeated(most, chunks))
        return np.asarray(np.maximum(shared, above / _LINEAR), np.float32)

    def left_out(self, number: int) -> Floats:
        """Return the variance of values beside those that a coarse level interpolates, for each sample of the guide."""
        above, beside = self._averaged(self.number + 1)
        kept = np.divide(beside, above, out=np.ones_like(above), where=above > 0)
        linear = np.minimum(self.below, above / _LINEAR)
        found = np.minimum(kept, 1) * linear + (self.below - linear) + self._of_steps
        if number < self.number:
            found = found * self._fractions(number, above)
        elif number > self.number:
            found = found + self._averaged(number)[1]
        return np.asarray(found, np.float32)

    @cached_property
    def _of_steps(self) -> Floats:
        """Variance left out by steps between samples, from second differences along all axes."""
        found = np.zeros_like(self.means)
        for axis in range(3):
            along = np.moveaxis(self.means, axis, 0)
            np.moveaxis(found, axis, 0)[1:-1] += np.diff(along, 2, axis=0) ** 2 / _STEP
        return found

    def _chunks(self, shape: tuple[int, ...], count: tuple[int, ...]) -> tuple[list[Integers], list[Runs]]:
        """Return the numbers of the chunks of level 0 along z, y, x, and the samples that lie in each."""
        level, numbers, chunks = self.volume.levels[self.number], [], []
        for axis, samples in enumerate(self.means.shape):
            at = level.first[2 - axis] + level.factor[2 - axis] * np.arange(samples)
            number = np.clip(np.floor((at + 0.5) / shape[axis]), 0, count[axis] - 1).astype(np.intp)
            chunks.append(Runs.of(np.flatnonzero(np.diff(number, prepend=-1)), samples))
            numbers.append(number[chunks[-1].starts])
        return numbers, chunks

    def _fractions(self, number: int, above: Floats) -> Numbers:
        """Return which fraction of the variance below the guide a finer level leaves out."""
        growths = np.geomspace(_LEAST_GROWTH, _MOST_GROWTH, _GROWTHS)
        sums = np.array([growths**k for k in range(self.number)]).cumsum(axis=0)
        beside_all = np.divide(above, self.below, out=np.full_like(above, np.inf), where=self.below > 0)
        return np.interp(beside_all, growths**self.number / sums[-1], sums[number - 1] / sums[-1])

    def _averaged(self, number: int) -> tuple[Floats, Floats]:
        """Return what the guide varies within samples of a coarser level, and beside values between these."""
        if number not in self._known:
            own, levels = np.array(self.volume.levels[self.number].factor), self.volume.levels
            factor = np.array(levels[number].factor) / own if number < len(levels) else np.array(_HALVED)
            steps = np.maximum(np.rint(factor), 1).astype(int)[::-1]
            shape = self.means.shape
            runs = [Runs.of(np.arange(0, n, step), n) for n, step in zip(shape, steps, strict=True)]
            coarse = _means(self.means, runs)
            between = coarse
            for axis, (run, count) in enumerate(zip(runs, shape, strict=True)):
                between = _between(between, axis, run.middles, count)
            within = np.maximum(_means(self.means**2, runs) - coarse**2, 0)
            beside = _means((self.means - between) ** 2, runs)
            self._known[number] = _repeated(within, runs), _repeated(beside, runs)
        return self._known[number]


def most_around(values: Floats) -> Floats:
    """Return the largest of each sample and those around it, for rays that pass between the worst."""
    found = values
    for axis in range(3):
        along = np.moveaxis(found, axis, 0)
        most = along.copy()
        np.maximum(most[1:], along[:-1], out=most[1:])
        np.maximum(most[:-1], along[1:], out=most[:-1])
        found = np.moveaxis(most, 0, axis)
    return found


def _means(values: NDArray[Any], runs: list[Runs]) -> Numbers:
    found: Numbers = values.astype(np.float64)
    for axis, run in enumerate(runs):
        shape = [-1 if each == axis else 1 for each in range(3)]
        found = np.add.reduceat(found, run.starts, axis=axis) / run.counts.reshape(shape)
    return found


def _repeated(values: Numbers, runs: list[Runs]) -> Floats:
    found = values.astype(np.float32)
    for axis, run in enumerate(runs):
        found = np.repeat(found, run.counts, axis=axis)
    return found


def _between(values: Numbers, axis: int, places: Numbers, count: int) -> Numbers:
    """Return values at places along an axis interpolated at 0, 1, … count - 1."""
    at = np.interp(np.arange(count), places, np.arange(len(places)))
    low = np.minimum(at.astype(int), max(len(places) - 2, 0))
    high = np.minimum(low + 1, len(places) - 1)
    part = (at - low).reshape([-1 if each == axis else 1 for each in range(3)])
    return np.asarray((1 - part) * np.take(values, low, axis) + part * np.take(values, high, axis))
