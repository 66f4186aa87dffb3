"""Matter of coarse samples, classified by the distribution of the values that they stand for, and not by their mean.

A sample of a coarse level is the mean of many of the finest. The medium of a mean is not the mean medium: thin bone has
a mean in which nothing shows. Here a coarse sample stands for values that are distributed normally about it, up to
three deviations away,

    E[q], E[τ]    of v ~ N(mean, variance below the sample)

(Younesy, Möller, Carr 2006), from a table of the transfer function smoothed by 64 widths. The variance below a sample
is what the finest level varies more within a chunk than the coarse one does, which the store's statistics tell, shared
out among the samples of the chunk by the squares of their gradients: most is lost where values change most. Without
statistics it is that of a linear function within the sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import ChunkStatistics, LargeVolume
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick
from texvol.util.threads import in_threads

NODES, ROWS = 2048, 64  # values and widths in the table
_WIDEST = 1.0  # of the transfer function's range: the last row; they grow by the squares of their numbers
CUT = 3.0  # deviations beyond which there is nothing
_OPAQUE = 20.0  # optical depth of a finest spacing that stands for an infinite one
_NOTHING = 1e-12  # of the largest: what transforms leave where there is nothing
_OF_A_SLOPE = 1 / 48  # variance of a linear function that rises by 1/2 from face to face
_LOOKED_AT = 8  # samples of a chunk along each axis that its means are made of, if it has so many
_LAYERS = 8  # of samples that are worked on at once where there are no chunks
_MOST = 1e30  # of a variance: a float32
_STORED = 65535  # texels of 16 bits: the row, from first to last

Numbers = NDArray[np.float64]
Floats = NDArray[np.float32]


class Smoothed:
    """A transfer function smoothed by widths of normal distributions.

    Parameters
    ----------
    transfer_function : TransferFunction
        Of which the medium depends on the value alone.
    finest_spacing : float
        World units: what emission and extinction are counted per, and what says how much stands for an infinite one.
    """

    def __init__(self, transfer_function: TransferFunction, finest_spacing: float) -> None:
        self._function, self._opaque, self.length_unit = transfer_function, _OPAQUE / finest_spacing, finest_spacing
        values = transfer_function.values
        low = float(values[0])
        self.range = float(values[-1] - values[0]) or max(abs(low), 1.0)
        self.ends = low - self.range, low + 2 * self.range  # of the table's values

    @cached_property
    def table(self) -> NDArray[np.float32]:
        """Emission and extinction per `length_unit`, shape (widths, values, 4): see `smoothed`."""
        return self.smoothed(self.medium * self.length_unit)

    @cached_property
    def medium(self) -> Numbers:
        """Emission and extinction of values from one of `ends` to the other, shape (values, 4)."""
        emission, extinction = self._function.classify(np.linspace(*self.ends, NODES))
        opaque = extinction > self._opaque
        glow = np.where(np.isinf(extinction), emission.T, emission.T / np.where(extinction > 0, extinction, 1.0)).T
        if not self._function.emissive:
            emission = np.where(opaque[:, np.newaxis], glow * self._opaque, emission)
        return np.column_stack([emission, np.minimum(extinction, self._opaque)])

    def smoothed(self, numbers: Numbers) -> NDArray[np.float32]:
        """Return numbers of the table's values, shape (values, n), smoothed by all widths, shape (widths, values, n).

        Row i is for the width i² / 63² of the function's range.
        """
        transformed = np.fft.rfft(np.pad(numbers, [(NODES, NODES), (0, 0)], mode="edge"), axis=0)
        table = [numbers]
        for row in range(1, ROWS):
            kernel = np.fft.rfft(_kernel(_WIDEST * (row / (ROWS - 1)) ** 2 * (NODES - 1) / 3))
            smoothed = np.fft.irfft(transformed * kernel[:, np.newaxis], 3 * NODES, axis=0)[NODES : 2 * NODES]
            table.append(np.where(smoothed > _NOTHING * numbers.max(axis=0), smoothed, 0.0))
        return np.array(table).astype(np.float32)

    def row_of(self, variances: Floats) -> Floats:
        """Return the rows, between those of the table too, of variances in squares of the range."""
        widths = np.minimum(np.sqrt(variances) / np.float32(_WIDEST), 1)
        return np.asarray((ROWS - 1) * np.sqrt(widths), np.float32)

    def stored(self, variances: Floats, unit: float) -> NDArray[np.uint16]:
        """Return the rows of variances in squares of a unit (of data), 65535 for the last row; none is beyond it."""
        root = np.sqrt(np.sqrt(variances, out=variances), out=variances)
        root *= np.float32(_STORED * math.sqrt(unit / (_WIDEST * self.range)))
        return root.astype(np.uint16)

    def reach(self, stored: NDArray[np.uint16]) -> Numbers:
        """Return how far from their mean values lie that rows stand for, at most, data units."""
        return CUT * (stored / _STORED) ** 2 * _WIDEST * self.range


def _kernel(deviation: float) -> Numbers:
    """Normal distribution about the first of 3 x NODES nodes that go round, of a sum of 1."""
    away = np.arange(3 * NODES, dtype=np.float64)
    away = np.minimum(away, 3 * NODES - away)
    kernel = np.where(away <= CUT * deviation, np.exp(-0.5 * (away / deviation) ** 2), 0.0)
    return kernel / kernel.sum()


@dataclass(frozen=True)
class Spread:
    """Distributions that the samples of a part stand for: `rows` of the function's table, shape (nz, ny, nx)."""

    function: Smoothed
    rows: NDArray[np.uint16]

    @property
    def without_samples(self) -> Spread:
        """The function alone."""
        return replace(self, rows=self.rows[:0].copy())


def spread_of(volume: LargeVolume, part: Volume, brick: Brick, function: Smoothed) -> Spread:
    """Return what the samples of a part of a coarse level stand for.

    Parameters
    ----------
    volume : LargeVolume
    part : Volume
        Samples of a coarse level.
    brick : Brick
        Where they lie.
    function : Smoothed
    """
    values, unit = _in_units(part)
    rows = np.empty(values.shape, np.uint16)
    chunks = _chunks_below(brick, volume.levels[0].statistics, values.shape, unit)
    of_last_row = (_WIDEST * function.range / unit) ** 2

    def fill(number: int) -> None:
        layers = chunks.z.layers(number)
        slopes, inner = _slopes(values, layers)
        share, most = (chunks.repeated(each) for each in chunks.shares(number, slopes, inner))
        slopes *= share
        np.minimum(slopes, np.minimum(most, np.float32(min(of_last_row, _MOST))), out=slopes)
        rows[layers] = function.stored(slopes, unit)

    in_threads(fill, range(len(chunks.z.starts)))
    return Spread(function, rows)


@dataclass(frozen=True)
class _Axis:
    """Chunks of the finest level beneath a part, along an axis: their numbers, and the first sample in each."""

    numbers: NDArray[np.intp]
    starts: NDArray[np.intp]
    samples: int

    @property
    def lengths(self) -> NDArray[np.intp]:
        """Samples in each."""
        return np.diff(self.starts, append=self.samples)

    def layers(self, number: int) -> slice:
        """Return the samples in one of them."""
        return slice(int(self.starts[number]), int(self.starts[number] + self.lengths[number]))

    @cached_property
    def looked_at(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """A few samples in each, and where those of each begin."""
        step = max(int(self.lengths.max()) // _LOOKED_AT, 1)
        some = [np.arange(first, first + n, step) for first, n in zip(self.starts, self.lengths, strict=True)]
        return np.concatenate(some), np.cumsum([0, *map(len, some[:-1])])


@dataclass(frozen=True)
class _Chunks:
    """Chunks of the finest level beneath a part; None known of one that has no statistics, as large as the part.

    `variances` and the `most` that a variance may be below a sample are of shape (cz, cy, cx).
    """

    z: _Axis
    y: _Axis
    x: _Axis
    variances: Numbers | None
    most: Numbers

    def shares(self, number: int, slopes: Floats, values: Floats) -> tuple[Numbers, Numbers]:
        """Return what the square of a slope counts in each chunk of some layers, and the most, shape (cy, cx).

        `slopes` are the squares and `values` the samples of these layers, of which some are looked at.
        """
        if self.variances is None:
            return np.full((1, 1), _OF_A_SLOPE), self.most[number]
        z = np.arange(0, len(values), max(len(values) // _LOOKED_AT, 1))
        where = np.ix_(z, self.y.looked_at[0], self.x.looked_at[0])
        some = values[where].astype(np.float64) - float(values.flat[0])
        varies = self._means(some**2) - self._means(some) ** 2
        lost = np.maximum(self.variances[number] - np.maximum(varies, 0.0), 0.0)
        slope = self._means(slopes[where].astype(np.float64))
        return np.where(slope > 0, lost / np.where(slope > 0, slope, 1.0), 0.0), self.most[number]

    def repeated(self, values: Numbers) -> Floats:
        """Return numbers of chunks (cy, cx) for each row and column of samples."""
        values = np.minimum(values, _MOST)
        return np.repeat(np.repeat(values.astype(np.float32), self.y.lengths, 0), self.x.lengths, 1)

    def _means(self, values: Numbers) -> Numbers:
        of_rows = np.add.reduceat(values.mean(axis=0, dtype=np.float64), self.y.looked_at[1], axis=0)
        sums = np.add.reduceat(of_rows, self.x.looked_at[1], axis=1)
        y, x = (np.diff(each.looked_at[1], append=len(each.looked_at[0])) for each in (self.y, self.x))
        return np.asarray(sums / np.outer(y, x))


def _chunks_below(brick: Brick, statistics: ChunkStatistics | None, shape: tuple[int, ...], unit: float) -> _Chunks:
    """Return the chunks beneath a part of some shape, with their statistics in squares of a unit."""
    if statistics is None:
        layers, one = np.arange(0, shape[0], _LAYERS), np.zeros(1, np.intp)
        whole = _Axis(layers, layers, shape[0]), _Axis(one, one, shape[1]), _Axis(one, one, shape[2])
        return _Chunks(*whole, None, np.full((len(layers), 1, 1), np.inf))
    axes = []
    for offset, factor, first, samples, length, count in zip(
        brick.offset, brick.factor, brick.stored_first, shape[::-1],
        statistics.chunk_shape[::-1], statistics.variance.shape[::-1], strict=True,
    ):  # fmt: skip
        chunk = np.floor((offset + factor * (first + np.arange(samples)) + 0.5) / length).astype(np.intp)
        chunk = np.clip(chunk, 0, count - 1)
        starts = np.flatnonzero(np.diff(chunk, prepend=-1))
        axes.append(_Axis(chunk[starts], starts, samples))
    x, y, z = axes
    where = np.ix_(z.numbers, y.numbers, x.numbers)
    with np.errstate(over="ignore", invalid="ignore"):
        variances = np.nan_to_num(statistics.variance[where] / unit / unit)
        most = np.nan_to_num(((statistics.maximum[where] - statistics.minimum[where]) / unit) ** 2 / 4)
    return _Chunks(z, y, x, variances, most)


def _in_units(part: Volume) -> tuple[NDArray, float]:
    """Return the values of a part in some unit, which is returned too: of squares that are numbers in float32."""
    if part.dtype.kind in "iu" and part.dtype.itemsize <= 2:
        return part.values, 1.0
    low, high = part.finite_range or (0.0, 0.0)
    unit = high / 2 - low / 2 or abs(low) or 1.0  # half of the range: all of it may be more than any number
    with np.errstate(over="ignore", invalid="ignore"):
        values = (part.values.astype(np.float64) / unit - low / unit).astype(np.float32)
    # What is missing or infinite is like the least.
    return np.clip(np.nan_to_num(values, nan=0.0), 0, 2), unit


def _slopes(values: NDArray, layers: slice) -> tuple[Floats, Floats]:
    """Return four times the squares of the gradients in some layers, and the values there."""
    around = np.clip(np.arange(layers.start - 1, layers.stop + 1), 0, len(values) - 1)
    samples = values[around].astype(np.float32)
    slopes, inner = samples[2:] - samples[:-2], samples[1:-1]
    np.square(slopes, out=slopes)
    rise = np.empty_like(slopes)
    for axis in (1, 2):
        along, into = np.moveaxis(inner, axis, 0), np.moveaxis(rise, axis, 0)
        if len(along) > 1:
            np.subtract(along[2:], along[:-2], out=into[1:-1])
            np.subtract(along[1], along[0], out=into[0])
            np.subtract(along[-1], along[-2], out=into[-1])
            np.square(rise, out=rise)
            slopes += rise
    return slopes, inner
