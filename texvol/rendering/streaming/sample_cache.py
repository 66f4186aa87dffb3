"""Samples of a large volume in memory: read in blocks of whole chunks, ahead of use, within a budget.

A block is read and decoded by one of several threads and kept until room is needed; the one that has not been used for
longest goes first, and none that has been asked for and not been used yet. So every chunk is decoded once as long as
what neighbouring parts have in common fits.
"""

from __future__ import annotations

import math
import os
import time
from collections import Counter, OrderedDict
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import Box, LargeVolume, SampleSource, Triple
from texvol.scene.volume import Volume
from texvol.util.errors import NoRoomError

_BLOCK = 4 << 20  # bytes of a block at most, unless a chunk is larger
_BLOCKS = 64  # that there is room for, unless a chunk is larger
_MOST_THREADS = 8
Block = tuple[int, int, int, int]  # level, and position along z, y, x


@dataclass
class Reading:
    """Counts and bytes of samples that were read."""

    chunks_decoded: int = 0
    hits: int = 0  # blocks whose samples were there, or on the way, when they were wanted
    peak_bytes: int = 0  # of samples in memory
    seconds_waited: float = 0.0
    bytes_read: int = 0  # from the store, as they are stored


class _Held:
    """A block in memory: its samples, which of its chunks are there or on the way, and what is on the way."""

    def __init__(self, low: Triple, high: Triple, chunk: Triple, dtype: np.dtype) -> None:
        self.low, self.high = low, high
        self.values = np.empty([b - a for a, b in zip(low, high, strict=True)], dtype)
        self.asked = np.zeros([-(-(b - a) // n) for a, b, n in zip(low, high, chunk, strict=True)], np.bool_)
        self.coming: list[Future[None]] = []

    @property
    def is_there(self) -> bool:
        """True if nothing is on the way."""
        return all(each.done() for each in self.coming)

    @property
    def has_failed(self) -> bool:
        """True if something could not be read."""
        return any(each.done() and each.exception() is not None for each in self.coming)


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
        self.block_shapes = [_block_shape(level.source, min(_BLOCK, room / _BLOCKS)) for level in volume.levels]
        threads = min(_MOST_THREADS, (os.cpu_count() or 1) + 1)
        self._pool = ThreadPoolExecutor(threads, "texvol-read")
        self._blocks: OrderedDict[Block, _Held] = OrderedDict()
        self._bytes = 0
        self._wanted: Counter[Block] = Counter()  # asked for, and not used yet
        self.reading = Reading()

    def need(self, chunks: Sequence[NDArray[np.bool_] | None]) -> None:
        """Say which chunks of each level matter, arrays of shape (cz, cy, cx); None: all of them.

        The others are not read: their samples become the least value that the store's statistics tell.
        """
        for level, (before, now) in enumerate(zip(self._needed, chunks, strict=True)):
            if before is None or (now is not None and not (now & ~before).any()):
                continue
            for block in [block for block in self._blocks if block[0] == level]:
                self._forget(block)
        self._needed = list(chunks)

    def ask(self, level: int, first: Triple, last: Triple) -> bool:
        """Begin to read what a part needs, for `part` later; False if there is no room for it now."""
        blocks = self._blocks_of(level, first, last)
        self._wanted.update(blocks)
        if not self._make_room(blocks):
            self._wanted.subtract(blocks)
            return False
        for block in blocks:
            self._begin(block, first, last)
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
        blocks = self._blocks_of(level, first, last)
        if not asked:
            self._wanted.update(blocks)
        try:
            if not self._make_room(blocks):
                whole = sum(self._bytes_of(block) for block in blocks)
                raise NoRoomError(
                    f"{self.volume.name}: memory must have room for the {whole / 1e6:.3g} MB of samples of one brick "
                    f"and its margin, got {self.room / 1e6:.3g} MB"
                )
            return self.volume.placed(level, first, self._assembled(level, first, last, blocks))
        finally:
            self._wanted.subtract(blocks)
            self._wanted += Counter()  # without those that nobody wants

    @property
    def stats(self) -> dict[str, Any]:
        """Report in JSON types for `--stats`."""
        return asdict(self.reading) | {"memory": self.room}

    @contextmanager
    def counted(self) -> Iterator[None]:
        """Count the bytes that are read inside."""
        before = self._bytes_of_sources()
        yield
        self.reading.bytes_read += self._bytes_of_sources() - before

    def close(self) -> None:
        """End the threads and forget all samples."""
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._blocks.clear()
        self._wanted.clear()
        self._bytes = 0

    def _assembled(self, level: int, first: Triple, last: Triple, blocks: list[Block]) -> NDArray:
        for block in blocks:
            self.reading.hits += not self._begin(block, first, last)
        start = np.array(first[::-1])
        values = np.empty(tuple(np.array(last[::-1]) - start), self.volume.levels[level].source.dtype)
        for block in blocks:
            held = self._blocks[block]
            self._blocks.move_to_end(block)
            self._wait_for(block, held)
            ends = zip(held.low, held.high, start, values.shape, strict=True)
            inner = [slice(max(a, s), min(b, s + n)) for a, b, s, n in ends]
            into = tuple(slice(i.start - s, i.stop - s) for i, s in zip(inner, start, strict=True))
            values[into] = held.values[
                tuple(slice(i.start - a, i.stop - a) for i, a in zip(inner, held.low, strict=True))
            ]
        return values

    def _wait_for(self, block: Block, held: _Held) -> None:
        start = None if held.is_there else time.perf_counter()
        try:
            for each in held.coming:
                each.result()
            held.coming.clear()
        except BaseException:
            self._forget(block)  # so that the next picture tries again
            raise
        finally:
            if start is not None:
                self.reading.seconds_waited += time.perf_counter() - start

    def _begin(self, block: Block, first: Triple, last: Triple) -> bool:
        """Begin to read the chunks of a block that a part needs; False if they are there or on the way."""
        level = block[0]
        own = self.volume.levels[level]
        chunk = own.source.chunk_shape
        if block in self._blocks and self._blocks[block].has_failed:
            self._forget(block)  # try again
        if block not in self._blocks:
            low, high = self._box_of(block)
            self._blocks[block] = _Held(low, high, chunk, own.source.dtype)
            self._bytes += self._bytes_of(block)
            self.reading.peak_bytes = max(self.reading.peak_bytes, self._bytes)
        held = self._blocks[block]
        wanted = zip(first[::-1], last[::-1], held.low, held.high, chunk, strict=True)
        box = tuple(slice((max(a, low) - low) // n, -(-(min(b, high) - low) // n)) for a, b, low, high, n in wanted)
        missing = np.zeros_like(held.asked)
        missing[box] = ~held.asked[box]
        if not missing.any():
            return False
        held.asked |= missing
        needed = self._needed[level]
        offset = [a // n for a, n in zip(held.low, chunk, strict=True)]
        if needed is not None:
            at = tuple(slice(o, o + n) for o, n in zip(offset, missing.shape, strict=True))
            assert own.statistics is not None, "what does not matter is known from statistics"
            for position in np.argwhere(missing & ~needed[at]).tolist():
                least = own.statistics.minimum[tuple(a + b for a, b in zip(position, offset, strict=True))]
                held.values[_in_block(held, chunk, position, [each + 1 for each in position])] = least
            missing &= needed[at]
        self.reading.chunks_decoded += int(missing.sum())
        for ends in _boxes_of(missing):
            held.coming.append(self._pool.submit(_read, own.source, held, _in_block(held, chunk, *ends)))
        return True

    def _make_room(self, blocks: list[Block]) -> bool:
        """Let blocks go that nobody wants until there is room for some; False if that is not enough."""
        needed = sum(self._bytes_of(block) for block in blocks if block not in self._blocks)
        if self._bytes + needed <= self.room:
            return True
        for block in list(self._blocks):
            if self._wanted[block] <= 0 and self._blocks[block].is_there:
                self._forget(block)
                if self._bytes + needed <= self.room:
                    return True
        return False

    def _forget(self, block: Block) -> None:
        del self._blocks[block]
        self._bytes -= self._bytes_of(block)

    def _blocks_of(self, level: int, first: Triple, last: Triple) -> list[Block]:
        shape = self.block_shapes[level]
        axes = [range(a // n, -(-b // n)) for a, b, n in zip(first[::-1], last[::-1], shape, strict=True)]
        return [(level, z, y, x) for z, y, x in product(*axes)]

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


def _read(source: SampleSource, held: _Held, box: Box) -> None:
    """Read a box of a block's samples into it."""
    z, y, x = (slice(a.start + low, a.stop + low) for a, low in zip(box, held.low, strict=True))
    held.values[box] = source.read((z, y, x))


def _in_block(held: _Held, chunk: Triple, low: Sequence[int], high: Sequence[int]) -> Box:
    """Return the samples of a block, counted from its first, that are those of some of its chunks."""
    ends = zip(low, high, chunk, held.values.shape, strict=True)
    z, y, x = (slice(int(a) * n, min(int(b) * n, most)) for a, b, n, most in ends)
    return z, y, x


def _boxes_of(chunks: NDArray[np.bool_]) -> list[tuple[list[int], list[int]]]:
    """Return first and last chunk of boxes of chunks: one for all if they fill it, else one for each chunk."""
    positions = np.argwhere(chunks)
    if not len(positions):
        return []
    low, high = positions.min(axis=0), positions.max(axis=0) + 1
    if chunks[tuple(slice(a, b) for a, b in zip(low, high, strict=True))].all():
        return [(low.tolist(), high.tolist())]
    return [(position.tolist(), (position + 1).tolist()) for position in positions]


def _block_shape(source: SampleSource, most_bytes: float) -> Triple:
    """Whole chunks, as cubic as may be, within some bytes."""
    shape = list(source.chunk_shape)
    while 2 * math.prod(shape) * source.dtype.itemsize <= most_bytes:
        shape[shape.index(min(shape))] *= 2
    return shape[0], shape[1], shape[2]
