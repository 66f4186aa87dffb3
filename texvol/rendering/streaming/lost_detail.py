"""Detail that coarse levels lack, from the statistics of all levels and the samples of the coarsest.

A sample of a level is the mean of those below it, so that variances add up: over the box of a chunk of level k,

    lost_k = mean of the variances of its chunks of level 0 + variance of their means - variance of its own samples

is the mean variance below a sample. A linear function loses four times as much with each level, noise most of it with
the first: what is lost beyond a quarter of what the next level loses more is *rough*, and no interpolation gets it back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import LargeVolume
from texvol.util.errors import InputError

Numbers = NDArray[np.float64]
_MOST = 1 << 24  # samples of the coarsest level, to be read


@dataclass(frozen=True)
class LostDetail:
    """Variances below the samples of each level but the finest, for each chunk of level 0, shape (cz, cy, cx)."""

    lost: list[Numbers]  # of levels 1, 2 …
    rough: list[Numbers]


def lost_detail(volume: LargeVolume) -> LostDetail | None:
    """Return what each level lacks; None where the statistics or a small coarsest level are missing.

    Raises
    ------
    InputError
        If the coarsest level cannot be read.
    """
    known: LostDetail | None = volume.__dict__.get("_lost_detail")
    if known is None and _is_known(volume):
        known = _found(volume)
        volume.__dict__["_lost_detail"] = known
    return known


def _is_known(volume: LargeVolume) -> bool:
    levels = volume.levels
    if len(levels) < 2 or any(level.statistics is None for level in levels):
        return False
    return bool(np.prod(levels[-1].source.shape, dtype=float) <= _MOST) and not volume.nearest


def _found(volume: LargeVolume) -> LostDetail:
    finest = volume.levels[0].statistics
    assert finest is not None
    variance = np.nan_to_num(finest.variance)
    means = _chunk_means(volume, finest.chunk_shape, variance.shape)
    lost = []
    for level in volume.levels[1:]:
        own = level.statistics
        assert own is not None
        # Chunks of level 0 in each chunk of this level.
        per_chunk = [
            max(round(n * f / fine), 1)
            for n, f, fine in zip(own.chunk_shape, level.factor[::-1], finest.chunk_shape, strict=True)
        ]
        below = _mean_of_boxes(variance, per_chunk)
        between = np.maximum(_mean_of_boxes(means**2, per_chunk) - _mean_of_boxes(means, per_chunk) ** 2, 0.0)
        kept = np.nan_to_num(own.variance)
        if kept.shape != below.shape:
            raise InputError(
                f"{volume.name}: statistics of a level must be of {below.shape} chunks, got those of {kept.shape}"
            )
        in_each = np.maximum(below + between - kept, 0.0)
        for axis, count in enumerate(per_chunk):
            in_each = np.repeat(in_each, count, axis)
        lost.append(in_each[tuple(slice(0, n) for n in variance.shape)])
    more = [after - before for before, after in zip(lost, lost[1:], strict=False)]
    more.append(more[-1] if more else np.zeros_like(variance))
    rough = [np.maximum(each - np.maximum(next_one, 0.0) / 4, 0.0) for each, next_one in zip(lost, more, strict=True)]
    if len(rough) > 1:
        rough[-1] = lost[-1]  # nothing tells how it would go on
    return LostDetail(lost, lost[:1] if len(lost) == 1 else rough)


def _chunk_means(volume: LargeVolume, chunk: tuple[int, ...], count: tuple[int, ...]) -> Numbers:
    """Mean of each chunk of level 0, from the samples of the coarsest level that lie in it."""
    coarsest = volume.levels[-1]
    z, y, x = (slice(0, n) for n in coarsest.source.shape)
    values = np.nan_to_num(coarsest.source.read((z, y, x)).astype(np.float64))
    for axis in range(3):
        index = coarsest.first[2 - axis] + coarsest.factor[2 - axis] * np.arange(values.shape[axis])
        of_chunk = np.clip(((index + 0.5) // chunk[axis]).astype(np.intp), 0, count[axis] - 1)
        # A chunk in which no sample lies has that of the nearest.
        nearest = np.clip(np.searchsorted(of_chunk, np.arange(count[axis])), 0, len(of_chunk) - 1)
        starts = np.flatnonzero(np.diff(of_chunk, prepend=-1))
        sums = np.add.reduceat(values, starts, axis=axis)
        numbers = np.diff(starts, append=len(of_chunk))
        means = sums / numbers.reshape([-1 if a == axis else 1 for a in range(3)])
        values = np.take(means, np.searchsorted(starts, nearest, side="right") - 1, axis=axis)
    return values


def _mean_of_boxes(values: Numbers, box: list[int]) -> Numbers:
    for axis, count in enumerate(box):
        starts = np.arange(0, values.shape[axis], count)
        numbers = np.diff(starts, append=values.shape[axis])
        values = np.add.reduceat(values, starts, axis=axis) / numbers.reshape(
            [-1 if a == axis else 1 for a in range(3)]
        )
    return values
