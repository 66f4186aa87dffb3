"""Samples of a large volume in memory: read in blocks of whole chunks, ahead of use, within a budget.

A block is read and decoded by one of several threads and kept until room is needed; the one that has not been used for
longest goes first, and none that has been asked for and not been used yet. So every chunk is decoded once as long as
what neighbouring parts have in common fits.
"""

from __future__ import annotations

import math
import os
import threading
import time
from collections import Counter, OrderedDict
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import LargeVolume, Triple
from texvol.scene.volume import Volume
from texvol.util.errors import NoRoomError

_BLOCK = 4 << 20  # bytes of a block at most, unless a chunk is larger
_MOST_THREADS = 8
Block = tuple[int, int, int, int]  # level, and position along z, y, x


@dataclass
class Reading:
    """What has been read."""

    chunks_decoded: int = 0
    blocks_read: int = 0
    hits: int = 0  # blocks that were there when they were wanted
    peak_bytes: int = 0  # of samples in memory
    seconds_waited: float = 0.0


class SampleCache:
    """Samples of a volume's levels, at most `room` bytes of them; to be used by one thread.

    Parameters
    ----------
    volume : LargeVolume
    room : int
        Bytes of samples.
    """

    def __init__(self, volume: LargeVolume, room: int) -> None:
        self.volume, self.room = volume, room
        self._needed: list[NDArray[np.bool_] | None] = [None] * len(volume.levels)
        self.block_shapes = [_block_shape(level.source.chunk_shape, level.source.dtype) for level in volume.levels]
        threads = min(_MOST_THREADS, (os.cpu_count() or 1) + 1)
        self._pool = ThreadPoolExecutor(threads, "texvol-read")
        self._blocks: OrderedDict[Block, Future[NDArray]] = OrderedDict()
        self._bytes = 0
        self._wanted: Counter[Block] = Counter()  # asked for, and not used yet
        self._lock = threading.Lock()
        self._first_bytes = self._bytes_of_sources()
        self.reading = Reading()

    def need(self, chunks: Sequence[NDArray[np.bool_] | None]) -> None:
        """Say which chunks of each level matter, arrays of shape (cz, cy, cx); None: all of them.

        The others are not read: their samples become the least value that the store's statistics tell. What is in
        memory stays if it has what matters.
        """
        for level, (before, now) in enumerate(zip(self._needed, chunks, strict=True)):
            if before is None or (now is not None and not (now & ~before).any()):
                continue
            for block in [block for block in self._blocks if block[0] == level]:
                self._forget(block)
            self._needed[level] = now
        if not self._blocks:
            self._needed = list(chunks)

    def ask(self, level: int, first: Triple, last: Triple) -> bool:
        """Begin to read what a part needs, for `part` later; False if there is no room for it now."""
        blocks = list(self._blocks_of(level, first, last))
        needed = sum(self._bytes_of(block) for block in blocks if block not in self._blocks)
        self._wanted.update(blocks)
        if not self._make_room(needed):
            self._wanted.subtract(blocks)
            return False
        for block in blocks:
            self._begin(block)
        return True

    def part(self, level: int, first: Triple, last: Triple, asked: bool) -> Volume:
        """Return the samples first … last - 1 of a level, along x, y, z, as a volume where they lie in the world.

        Parameters
        ----------
        asked : bool
            True if `ask` was told of it, and agreed.

        Raises
        ------
        InputError
            If a chunk cannot be read.
        NoRoomError
            If the budget has no room for one part.
        """
        blocks = list(self._blocks_of(level, first, last))
        if not asked:
            self._wanted.update(blocks)
        try:
            values = self._assembled(level, first, last, blocks)
        finally:
            self._wanted.subtract(blocks)
            self._wanted += Counter()  # without those that nobody wants
        return self.volume.placed(level, first, values)

    @property
    def stats(self) -> dict[str, Any]:
        """Report in JSON types for `--stats`."""
        return {"bytes_read": self._bytes_of_sources() - self._first_bytes, "memory": self.room} | asdict(self.reading)

    def close(self) -> None:
        """End the threads and forget all samples."""
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._blocks.clear()
        self._wanted.clear()
        self._bytes = 0

    def _assembled(self, level: int, first: Triple, last: Triple, blocks: list[Block]) -> NDArray:
        source = self.volume.levels[level].source
        self.reading.hits += sum(block in self._blocks for block in blocks)
        needed = sum(self._bytes_of(block) for block in blocks if block not in self._blocks)
        if not self._make_room(needed):
            whole = sum(self._bytes_of(block) for block in blocks)
            raise NoRoomError(
                f"{self.volume.name}: memory must have room for the {whole / 1e6:.3g} MB of samples of one brick and "
                f"its margin, got {self.room / 1e6:.3g} MB"
            )
        for block in blocks:
            self._begin(block)
        start = np.array(first[::-1])
        values = np.empty(tuple(np.array(last[::-1]) - start), source.dtype)
        for block in blocks:
            future = self._blocks[block]
            self._blocks.move_to_end(block)
            low, high = self._box_of(block)
            inner = tuple(
                slice(max(a, s), min(b, s + n)) for a, b, s, n in zip(low, high, start, values.shape, strict=True)
            )
            into = tuple(slice(i.start - s, i.stop - s) for i, s in zip(inner, start, strict=True))
            values[into] = self._samples(future)[
                tuple(slice(i.start - a, i.stop - a) for i, a in zip(inner, low, strict=True))
            ]
        return values

    def _samples(self, future: Future[NDArray]) -> NDArray:
        if future.done():
            return future.result()
        start = time.perf_counter()
        try:
            return future.result()
        finally:
            self.reading.seconds_waited += time.perf_counter() - start

    def _begin(self, block: Block) -> None:
        if block in self._blocks:
            return
        low, high = self._box_of(block)
        self._bytes += self._bytes_of(block)
        self.reading.peak_bytes = max(self.reading.peak_bytes, self._bytes)
        self.reading.blocks_read += 1
        self._blocks[block] = self._pool.submit(self._read, block[0], low, high)

    def _read(self, level: int, low: Triple, high: Triple) -> NDArray:
        """Read a block, without the chunks that do not matter."""
        own = self.volume.levels[level]
        chunk, needed = own.source.chunk_shape, self._needed[level]
        first = [a // n for a, n in zip(low, chunk, strict=True)]
        last = [-(-b // n) for b, n in zip(high, chunk, strict=True)]
        z, y, x = (slice(a, b) for a, b in zip(first, last, strict=True))
        matters = (
            np.ones([b - a for a, b in zip(first, last, strict=True)], bool) if needed is None else needed[z, y, x]
        )
        with self._lock:
            self.reading.chunks_decoded += int(matters.sum())
        if matters.all():
            z, y, x = (slice(a, b) for a, b in zip(low, high, strict=True))
            return own.source.read((z, y, x))
        assert own.statistics is not None, "what does not matter is known from statistics"
        values = np.empty([b - a for a, b in zip(low, high, strict=True)], own.source.dtype)
        least = own.statistics.minimum[z, y, x].astype(own.source.dtype)
        for position in np.ndindex(*matters.shape):
            ends = [
                (max(n * (f + p), a), min(n * (f + p + 1), b))
                for n, f, p, a, b in zip(chunk, first, position, low, high, strict=True)
            ]
            into = tuple(slice(start - a, stop - a) for (start, stop), a in zip(ends, low, strict=True))
            box = slice(*ends[0]), slice(*ends[1]), slice(*ends[2])
            values[into] = own.source.read(box) if matters[position] else least[position]
        return values

    def _make_room(self, needed: int) -> bool:
        """Let blocks go that nobody wants until there is room; False if that is not enough."""
        if self._bytes + needed <= self.room:
            return True
        for block in list(self._blocks):
            if self._wanted[block] <= 0 and self._blocks[block].done():
                self._forget(block)
                if self._bytes + needed <= self.room:
                    return True
        return False

    def _forget(self, block: Block) -> None:
        self._blocks.pop(block).cancel()
        self._bytes -= self._bytes_of(block)

    def _blocks_of(self, level: int, first: Triple, last: Triple) -> Iterator[Block]:
        shape = self.block_shapes[level]
        axes = [range(a // n, -(-b // n)) for a, b, n in zip(first[::-1], last[::-1], shape, strict=True)]
        return ((level, z, y, x) for z, y, x in product(*axes))

    def _box_of(self, block: Block) -> tuple[Triple, Triple]:
        """First and last sample of a block along z, y, x."""
        shape, whole = self.block_shapes[block[0]], self.volume.levels[block[0]].source.shape
        low = tuple(position * n for position, n in zip(block[1:], shape, strict=True))
        high = tuple(min(a + n, most) for a, n, most in zip(low, shape, whole, strict=True))
        return low, high  # type: ignore[return-value]

    def _bytes_of(self, block: Block) -> int:
        low, high = self._box_of(block)
        samples = math.prod(b - a for a, b in zip(low, high, strict=True))
        return samples * self.volume.levels[block[0]].source.dtype.itemsize

    def _bytes_of_sources(self) -> int:
        return sum({id(level.source): level.source.bytes_read for level in self.volume.levels}.values())


def _block_shape(chunk_shape: Triple, dtype: np.dtype) -> Triple:
    """Whole chunks, as cubic as may be, within the bytes of a block."""
    shape = list(chunk_shape)
    while 2 * math.prod(shape) * dtype.itemsize <= _BLOCK:
        shape[shape.index(min(shape))] *= 2
    return shape[0], shape[1], shape[2]
