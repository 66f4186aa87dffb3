"""Matter of coarse samples, classified by the distribution of the values that they stand for, and not by their mean.

A sample of a coarse level is the mean of many of the finest. The medium of a mean is not the mean medium: thin bone has
a mean in which nothing shows. Here a coarse sample stands for values that are distributed normally about it,

    E[q], E[τ]    of v ~ N(mean, variance below the sample)

(Younesy, Möller, Carr 2006), from tables of the transfer function smoothed by 48 widths. The variance below a sample is
what the finest level varies more within a chunk than the coarse one does, which the store's statistics tell, shared out
among the samples of the chunk by the squares of their gradients: most is lost where values change most. Without
statistics it is that of a linear function within the sample.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import LargeVolume
from texvol.scene.transfer import Classified, TransferFunction
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick

_NODES, _WIDTHS, _FINER = 2048, 48, 4
_NARROWEST, _WIDEST = 1 / 2048, 1.0  # of the transfer function's range
_OPAQUE = 20.0  # optical depth of a finest spacing that stands for an infinite one
_OF_A_SLOPE = 1 / 12  # variance of a linear function that rises by 1 from face to face

Numbers = NDArray[np.float64]


class Smoothed:
    """A transfer function smoothed by widths of normal distributions; extinction is per world unit.

    `finest_spacing` (world units) says what stands for infinite extinctions.
    """

    def __init__(self, transfer_function: TransferFunction, finest_spacing: float) -> None:
        self._function, self._opaque = transfer_function, _OPAQUE / finest_spacing
        values = transfer_function.values
        self._low, self._range = float(values[0]), float(values[-1] - values[0]) or max(abs(float(values[0])), 1.0)

    def classify(self, means: NDArray, deviations: Numbers) -> Classified:
        """Return mean emission (n, 3) and extinction (n) of values of some means and standard deviations, (n,)."""
        known = ~np.isnan(means)
        at = (np.where(known, means, self._low).astype(np.float64) - self._low) / self._range
        # Beyond the ends of the function the nodes go on for as wide as the distribution may be.
        node = np.clip((at.astype(np.float32) + 1) * np.float32((_NODES - 1) / 3), 0, np.float32(_NODES - 1))
        wide = np.maximum((deviations / (self._range * _NARROWEST)).astype(np.float32), np.float32(1e-30))
        # The nearest of many widths: as good as between fewer, and half of the work.
        width = np.log(wide) * np.float32(_FINER / self._step) + np.float32(_FINER + 0.5)
        row = np.clip(width, 0, _WIDTHS * _FINER).astype(np.intp)
        i = np.minimum(node.astype(np.intp), _NODES - 2)
        s, place = (node - i)[:, np.newaxis], row * _NODES + i
        numbers = self._rows.take(place, axis=0)
        after = self._rows.take(place + 1, axis=0)
        after -= numbers
        after *= s
        numbers += after
        if not known.all():
            numbers[~known] = 0
        found = numbers.astype(np.float64)
        return Classified(found[:, :3], found[:, 3])

    @cached_property
    def _rows(self) -> NDArray[np.float32]:
        """The table with more widths, one row for each width and node."""
        fine = np.arange(_WIDTHS * _FINER + 1) / _FINER
        below = np.minimum(fine.astype(np.intp), _WIDTHS - 1)
        t = (fine - below)[:, np.newaxis, np.newaxis].astype(np.float32)
        table = self._table.astype(np.float32)
        return ((1 - t) * table[below] + t * table[below + 1]).reshape(-1, 4)

    @cached_property
    def largest(self) -> Classified:
        """The most that any emission and extinction may be."""
        most = self._table[0].max(axis=0)
        return Classified(most[np.newaxis, :3], most[3:])

    @cached_property
    def _step(self) -> float:
        return float(np.log(_WIDEST / _NARROWEST) / (_WIDTHS - 1))

    @cached_property
    def _table(self) -> Numbers:
        """Smoothed medium at nodes from a range below the function to a range above, shape (widths + 1, nodes, 4)."""
        values = self._low + self._range * np.linspace(-1, 2, _NODES)
        emission, extinction = self._function.classify(values)
        opaque = extinction > self._opaque
        glow = np.where(np.isinf(extinction), emission.T, emission.T / np.where(extinction > 0, extinction, 1.0)).T
        if not self._function.emissive:
            emission = np.where(opaque[:, np.newaxis], glow * self._opaque, emission)
        medium = np.column_stack([emission, np.minimum(extinction, self._opaque)])
        frequencies = np.fft.rfftfreq(3 * _NODES) * (_NODES - 1) / 3  # per range of the function
        padded = np.pad(medium, [(_NODES, _NODES), (0, 0)], mode="edge")
        transformed = np.fft.rfft(padded, axis=0)
        table = [medium]
        for number in range(_WIDTHS):
            width = _NARROWEST * np.exp(number * self._step)
            factor = np.exp(-2 * (np.pi * frequencies * width) ** 2)
            smoothed = np.fft.irfft(transformed * factor[:, np.newaxis], 3 * _NODES, axis=0)[_NODES : 2 * _NODES]
            table.append(np.maximum(smoothed, 0.0))
        return np.array(table)


def deviations(volume: LargeVolume, part: Volume, brick: Brick) -> Numbers:
    """Standard deviation of the finest values that each sample of a part stands for, data units, of the part's shape.

    Parameters
    ----------
    volume : LargeVolume
    part : Volume
        Samples of a coarse level.
    brick : Brick
        Where they lie.
    """
    values = np.nan_to_num(part.values.astype(np.float64))
    slopes = sum((_difference(values, axis) ** 2 for axis in range(3)), np.zeros(values.shape))
    statistics = volume.levels[0].statistics
    if statistics is None:
        return np.sqrt(_OF_A_SLOPE * slopes)
    chunks = [
        np.floor((offset + factor * np.arange(first, last) + 0.5) / chunk).astype(np.intp)
        for offset, factor, first, last, chunk in zip(
            brick.offset, brick.factor, brick.stored_first, brick.stored_last, statistics.chunk_shape[::-1], strict=True
        )
    ][::-1]
    chunks = [np.clip(each, 0, count - 1) for each, count in zip(chunks, statistics.variance.shape, strict=True)]
    starts = [np.flatnonzero(np.diff(each, prepend=-1)) for each in chunks]
    count = _sums(np.ones(values.shape), starts)
    mean = _sums(values, starts) / count
    varies = np.maximum(_sums(values**2, starts) / count - mean**2, 0.0)
    z, y, x = (each[start] for each, start in zip(chunks, starts, strict=True))
    finest = np.nan_to_num(statistics.variance[np.ix_(z, y, x)])
    span = statistics.maximum[np.ix_(z, y, x)] - statistics.minimum[np.ix_(z, y, x)]
    lost = np.maximum(finest - varies, 0.0)
    slope = _sums(slopes, starts) / count
    share = np.where(slope > 0, lost / np.where(slope > 0, slope, 1.0), 0.0)
    spread = _repeated(share, starts, values.shape) * slopes + _repeated(
        np.where(slope > 0, 0.0, lost), starts, values.shape
    )
    return np.sqrt(np.minimum(spread, _repeated(np.nan_to_num(span) ** 2 / 4, starts, values.shape)))


def _difference(values: Numbers, axis: int) -> Numbers:
    """Half the difference of the next and the last sample, the outermost standing for those beyond them."""
    values = np.moveaxis(values, axis, 0)
    padded = np.concatenate([values[:1], values, values[-1:]])
    return np.moveaxis((padded[2:] - padded[:-2]) / 2, 0, axis)


def _sums(values: Numbers, starts: list[NDArray[np.intp]]) -> Numbers:
    for axis, each in enumerate(starts):
        values = np.add.reduceat(values, each, axis=axis)
    return values


def _repeated(values: Numbers, starts: list[NDArray[np.intp]], shape: tuple[int, ...]) -> Numbers:
    for axis, each in enumerate(starts):
        values = np.repeat(values, np.diff(each, append=shape[axis]), axis=axis)
    return values
