"""Samples of a large volume in memory: read in whole chunks, ahead of use, within a budget.

A chunk is read and decoded in the background and kept until room is needed. The one that has not been used for longest
goes first, and none that has been asked for and not been used yet. So every chunk is decoded once as long as what
neighbouring parts have in common fits.
"""

from __future__ import annotations

import math
import os
from collections import Counter, OrderedDict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.streaming.assembly import Assembly, Held, InMemory, Pending, Piece
from texvol.rendering.streaming.chunk_grid import ChunkGrid, Place
from texvol.scene.large_volume import Box, LargeVolume, SampleSource, Triple
from texvol.scene.volume import Volume
from texvol.util.errors import NoRoomError

_MOST_THREADS = 8
Part = tuple[int, Triple, Triple]  # level, first sample along x, y, z, and the one behind the last
Chunk = tuple[int, int, int, int]  # level, and place along z, y, x
# Which of some boxes, low and high corners along x, y, z in samples of a level, shape (n, 2, 3), need not be read.
Hidden = Callable[[int, NDArray[np.float64]], NDArray[np.bool_]]


@dataclass
class Reading:
    """Counts and bytes of samples that were read."""

    chunks_decoded: int = 0
    bytes_wanted: int = 0  # of samples in the chunks that the last picture wanted, each counted once
    hits: int = 0  # chunks whose samples were there, or on the way, when they were wanted
    peak_bytes: int = 0  # of samples in memory
    seconds_waited: float = 0.0
    bytes_read: int = 0  # from the store, as they are stored


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
        self._levels = [ChunkGrid(level) for level in volume.levels]
        threads = min(_MOST_THREADS, (os.cpu_count() or 1) + 1)
        self._pool = ThreadPoolExecutor(threads, "texvol-read")
        self._chunks: OrderedDict[Chunk, Held] = OrderedDict()
        self._bytes = 0
        self._wanted: Counter[Chunk] = Counter()  # asked for, and not used yet
        self._of_picture: set[Chunk] = set()  # that the last picture wanted
        self._buffers: list[NDArray[np.uint8]] = []  # of parts that are not needed any more
        self._uses: list[NDArray[np.int32]] | None = None  # of each chunk of each level, by parts to come
        self.reading = Reading()

    def need(self, chunks: Sequence[NDArray[np.bool_] | None]) -> None:
        """Begin a picture, and say which chunks of each level matter, arrays of shape (cz, cy, cx); None: all of them.

        The others are not read: their samples become the least value that the store's statistics tell.
        """
        self._of_picture.clear()
        self.reading.bytes_wanted = 0
        for each, now in zip(self._levels, chunks, strict=True):
            each.needed = now

    def expect(self, parts: Sequence[Part]) -> None:
        """Say which parts will be asked for, each once: where not all have room, chunks go after their last use.

        Memory that is used again is quicker than new memory, and its pages are there.
        """
        uses = [np.zeros([len(ends) for ends in grid.ends], np.int32) for grid in self._levels]
        for level, first, last in parts:
            uses[level][self._levels[level].places(first, last)] += 1
        total = sum(grid.bytes_of_all(each > 0) for grid, each in zip(self._levels, uses, strict=True))
        self._uses = uses if total > self.room else None

    def pass_by(self, level: int, first: Triple, last: Triple) -> None:
        """Say that a part that was expected will not be asked for."""
        if self._uses is not None:
            places = self._levels[level].places(first, last)
            self._uses[level][places] -= 1
            unused = np.argwhere(self._uses[level][places] <= 0) + [part.start for part in places]
            self._drop([(level, z, y, x) for z, y, x in unused.tolist()])

    def ask(
        self, level: int, first: Triple, last: Triple, hidden: Hidden | None = None, leaves_gaps: bool = False
    ) -> Assembly | None:
        """Begin to read the samples first … last - 1 of a level, along x, y, z; None if there is no room for it now.

        Whoever has used it, or no longer wants it, has to say so to `done`.

        Parameters
        ----------
        hidden : callable, optional
            Says what is not read if it is not there already.
        leaves_gaps : bool
            True if samples of chunks that do not matter may be anything, but for those next to a chunk that is read.
        """
        grid = self._levels[level]
        wanted, unread, has_holes = self._sorted_out(level, grid.places(first, last), hidden, leaves_gaps)
        part_bytes = math.prod(b - a for a, b in zip(first, last, strict=True)) * grid.dtype.itemsize
        self._wanted.update(wanted)
        if not self._make_room(wanted, part_bytes):
            self._let_go(wanted)
            return None
        z, y, x = grid.ends
        pieces = [Piece(z[k], y[j], x[i], self._held(level, (k, j, i))) for _, k, j, i in wanted]
        pieces += [grid.unread(place) for place in unread]
        self._bytes += part_bytes
        self.reading.peak_bytes = max(self.reading.peak_bytes, self._bytes)
        buffer = self._buffer(part_bytes)
        return Assembly(level, first, last, grid.dtype, pieces, wanted, part_bytes, buffer, has_holes)

    def done(self, assembly: Assembly, reuse: bool = False) -> None:
        """Let the chunks of a part go when others need room; with `reuse` its samples may be overwritten."""
        self._let_go(assembly.chunks)
        self._bytes -= assembly.bytes
        self.pass_by(assembly.level, assembly.first, assembly.last)
        if reuse and assembly.buffer is not None:
            self._buffers.append(assembly.buffer)

    def part(self, level: int, first: Triple, last: Triple) -> Volume:
        """Return the samples first … last - 1 of a level, along x, y, z, as a volume where they lie in the world.

        Raises
        ------
        InputError
            If a chunk cannot be read.
        NoRoomError
            If the budget has no room for one part.
        """
        assembly = self.ask(level, first, last)
        if assembly is None:
            raise self.no_room(level, first, last)
        try:
            return self.volume.placed(level, first, assembly.values())
        finally:
            self.done(assembly)

    def no_room(self, level: int, first: Triple, last: Triple) -> NoRoomError:
        """Return the error of a part that the budget has no room for."""
        grid = self._levels[level]
        lengths = [
            [b - a for a, b in ends[part]] for ends, part in zip(grid.ends, grid.places(first, last), strict=True)
        ]
        samples = math.prod(map(sum, lengths)) + math.prod(b - a for a, b in zip(first, last, strict=True))
        whole = samples * grid.dtype.itemsize
        return NoRoomError(
            f"{self.volume.name}: memory must have room for the {whole / 1e6:.3g} MB of one brick with its "
            f"margin and of the chunks that it is in, got {self.room / 1e6:.3g} MB: allow more by --memory"
        )

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
        self.forget()

    def forget(self) -> None:
        """Forget all samples; nobody may want any."""
        self._chunks.clear()
        self._wanted.clear()
        self._buffers.clear()
        self._bytes = 0

    def _sorted_out(
        self, level: int, places: Box, hidden: Hidden | None, leaves_gaps: bool
    ) -> tuple[list[Chunk], list[Place], bool]:
        """Return the chunks at some places that are read and the places that are filled; True if any is hidden."""
        grid = self._levels[level]
        low = np.array([part.start for part in places])
        matters = np.ones([part.stop - part.start for part in places], np.bool_)
        if grid.needed is not None:
            matters &= grid.needed[places]
        behind = np.zeros((0, 3), np.intp)
        if hidden is not None:
            asked = np.array([at for at in (np.argwhere(matters) + low).tolist() if (level, *at) not in self._chunks])
            if asked.size:
                ends = [np.array(each)[at] for each, at in zip(grid.ends, asked.T, strict=True)]
                behind = asked[hidden(level, np.stack(ends[::-1], axis=2).astype(np.float64))] - low
                matters[tuple(behind.T)] = False
        filled = ~matters
        if leaves_gaps:
            filled &= grid.around(matters)
            filled[tuple(behind.T)] = True
        wanted: list[Chunk] = [(level, z, y, x) for z, y, x in (np.argwhere(matters) + low).tolist()]
        return wanted, [(z, y, x) for z, y, x in (np.argwhere(filled) + low).tolist()], bool(behind.size)

    def _held(self, level: int, place: Place) -> Held:
        """Return a chunk that is there or on the way; begin to read it if it is neither."""
        chunk = (level, *place)
        if chunk not in self._of_picture:
            self._of_picture.add(chunk)
            self.reading.bytes_wanted += self._levels[level].bytes(place)
        held = self._chunks.get(chunk)
        if held is not None:
            self.reading.hits += 1
            self._chunks.move_to_end(chunk)
            return held
        grid = self._levels[level]
        if level == self.volume.level_in_memory and "overview" in vars(self.volume):
            self.reading.hits += 1
            held = Held(InMemory(self.volume.overview.values[grid.box(place)]))
        else:
            self.reading.chunks_decoded += 1
            held = Held(self._begin(grid.source, grid.box(place)))
        self._chunks[chunk] = held
        self._bytes += grid.bytes(place)
        return held

    def _begin(self, source: SampleSource, box: Box) -> Pending:
        """Begin to read a box in the background, by the source itself if it can."""
        begin: Callable[[Box], Pending] | None = getattr(source, "begin", None)
        return begin(box) if begin is not None else self._pool.submit(source.read, box)

    def _buffer(self, count: int) -> NDArray[np.uint8] | None:
        """Return memory for so many bytes that has been touched before, if there is any."""
        for number, buffer in enumerate(self._buffers):
            if buffer.nbytes >= count:
                return self._buffers.pop(number)
        self._buffers.clear()
        return None

    def _make_room(self, chunks: list[Chunk], more: int) -> bool:
        """Let chunks go that nobody wants until there is room for some and `more` bytes; False if there is not."""
        needed = more + sum(self._levels[chunk[0]].bytes(chunk[1:]) for chunk in chunks if chunk not in self._chunks)
        if self._bytes + needed <= self.room:
            return True
        gone, missing = [], self._bytes + needed - self.room
        for chunk, held in self._chunks.items():
            if chunk not in self._wanted and held.is_there:
                gone.append(chunk)
                missing -= self._levels[chunk[0]].bytes(chunk[1:])
                if missing <= 0:
                    break
        for chunk in gone:
            self._forget(chunk)
        return missing <= 0

    def _drop(self, chunks: list[Chunk]) -> None:
        """Forget chunks that no part will need, if they are there."""
        for chunk in chunks:
            held = self._chunks.get(chunk)
            if held is not None and held.is_there and chunk not in self._wanted:
                self._forget(chunk)

    def _let_go(self, chunks: list[Chunk]) -> None:
        self._wanted.subtract(chunks)
        for chunk in chunks:
            if self._wanted[chunk] <= 0:
                del self._wanted[chunk]

    def _forget(self, chunk: Chunk) -> None:
        del self._chunks[chunk]
        self._bytes -= self._levels[chunk[0]].bytes(chunk[1:])

    def _bytes_of_sources(self) -> int:
        return sum({id(level.source): level.source.bytes_read for level in self.volume.levels}.values())
