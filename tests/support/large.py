"""Large volumes of arrays in memory, with pyramids and statistics made by plain numpy."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import Box, ChunkStatistics, LargeVolume, Level
from texvol.scene.volume import Volume


class Counted:
    """Samples of an array that count which chunks are read, and how often."""

    def __init__(self, array: NDArray, chunk: int) -> None:
        self.array, self.chunk = array, chunk
        self.reads = np.zeros([-(-n // chunk) for n in array.shape], int)
        self.bytes_read = 0

    @property
    def shape(self) -> tuple[int, int, int]:
        nz, ny, nx = self.array.shape
        return nz, ny, nx

    @property
    def dtype(self) -> np.dtype:
        return self.array.dtype

    @property
    def chunk_shape(self) -> tuple[int, int, int]:
        return self.chunk, self.chunk, self.chunk

    def read(self, box: Box) -> NDArray:
        self.reads[tuple(slice(part.start // self.chunk, -(-part.stop // self.chunk)) for part in box)] += 1
        values = self.array[box].copy()
        self.bytes_read += values.nbytes
        return values


_KNOWN: dict[tuple[bytes, str, tuple[int, ...], int], ChunkStatistics] = {}


def statistics_of(array: NDArray, chunk: int) -> ChunkStatistics:
    """Statistics of every chunk; those of equal arrays are counted once, since tests share a few volumes."""
    key = sha256(np.ascontiguousarray(array)).digest(), array.dtype.str, array.shape, chunk
    if key not in _KNOWN:
        _KNOWN[key] = _statistics(array, chunk)
    return _KNOWN[key]


def _statistics(array: NDArray, chunk: int) -> ChunkStatistics:
    """Statistics of every chunk, one by one."""
    counts = [-(-n // chunk) for n in array.shape]
    found = np.empty((5, *counts))
    for position in np.ndindex(*counts):
        own = array[tuple(slice(chunk * i, chunk * i + chunk) for i in position)]
        around = array[tuple(slice(max(chunk * i - 1, 0), chunk * i + chunk + 1) for i in position)]
        variance = np.nanvar if np.isnan(own).any() else np.var  # which are equal without NaN; np.var is quicker
        numbers = np.fmin.reduce(own, None), np.fmax.reduce(own, None), variance(own.astype(float))
        found[(slice(None), *position)] = *numbers, np.fmin.reduce(around, None), np.fmax.reduce(around, None)
    found.flags.writeable = False
    return ChunkStatistics((chunk, chunk, chunk), *found)


def halved(array: NDArray) -> NDArray:
    """Means of pairs along each axis; at the end of odd numbers the last sample counts twice."""
    padded = np.pad(array, [(0, n % 2) for n in array.shape], mode="edge").astype(np.float64)
    z, y, x = (n // 2 for n in padded.shape)
    means = padded.reshape(z, 2, y, 2, x, 2).mean((1, 3, 5))
    return (np.rint(means) if array.dtype.kind in "iu" else means).astype(array.dtype)


def large(
    volume: Volume, chunk: int = 16, levels: int = 3, memory: int | None = None, statistics: bool = True
) -> tuple[LargeVolume, list[Counted]]:
    """The volume as a store of chunks in memory, and the sources of its levels."""
    array, factor, made, sources = volume.values, 1, [], []
    for _ in range(levels):
        sources.append(Counted(array, chunk))
        known = statistics_of(array, chunk) if statistics else None
        first = ((factor - 1) / 2,) * 3
        made.append(Level(sources[-1], (float(factor),) * 3, first, known))
        array, factor = halved(array), 2 * factor
    return of_levels(made, volume, memory), sources


def of_levels(levels: Sequence[Level], volume: Volume, memory: int | None = None) -> LargeVolume:
    """A large volume where another one lies."""
    place = volume.spacing, volume.origin, volume.direction
    return LargeVolume(levels, *place, memory=memory, name=volume.name, source={"built_in": "test"})
