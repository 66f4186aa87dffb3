"""Samples of one level of a store: a box is read at once; if that fails, chunk by chunk, to name the chunk at fault."""

from __future__ import annotations

import itertools
import math
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.missing import Mark
from texvol.formats.readers.samples import FileFault
from texvol.formats.stores.access import ServerFault
from texvol.scene.large_volume import Box, Triple
from texvol.util import remarks
from texvol.util.errors import InputError

_EXACT_BITS = 24  # of the integers that float32 holds
_MOST_CHUNKS = 1 << 28  # of a level, 100 TB of plain ones; and along an axis: tables of them are held in memory
_MOST_ALONG = 1 << 18


@dataclass(frozen=True)
class Layout:
    """Where the axes z, y, x of the samples lie among those of a stored array.

    `index` has a number for each axis that is fixed and None for each that is kept; `order` has, for z, y and x, the
    number of the stored axis, or None for an axis that the array lacks.
    """

    names: tuple[str, ...]
    sizes: tuple[int, ...]
    index: tuple[int | None, ...]
    order: tuple[int | None, int | None, int | None]

    def spatial(self, numbers: Sequence[int]) -> Triple:
        """Return those of z, y, x of numbers that belong to the stored axes; 1 for an axis that it lacks."""
        z, y, x = (1 if each is None else int(numbers[each]) for each in self.order)
        return z, y, x

    def stored(self, box: Box) -> tuple[int | slice, ...]:
        """Return the index of a box in the stored array."""
        found: list[int | slice] = [0 if each is None else each for each in self.index]
        for axis, part in zip(self.order, box, strict=True):
            if axis is not None:
                found[axis] = part
        return tuple(found)

    def turned(self, part: NDArray) -> NDArray:
        """Return what the stored array has at such an index with the axes z, y, x."""
        kept = [axis for axis, each in enumerate(self.index) if each is None]
        present = [each for each in self.order if each is not None]
        turned = part.transpose([kept.index(each) for each in present])
        missing = tuple(number for number, each in enumerate(self.order) if each is None)
        return np.expand_dims(turned, missing) if missing else turned

    def chunk(self, place: Triple, chunk: Sequence[int]) -> str:
        """Return the indices of the chunk in which the sample (z, y, x) lies, as a message names them."""
        position = [0 if each is None else each for each in self.index]
        for axis, number in zip(self.order, place, strict=True):
            if axis is not None:
                position[axis] = number
        numbers = [at // size for at, size in zip(position, chunk, strict=True)]
        return f"chunk {', '.join(map(str, numbers))} ({', '.join(self.names)})"


@dataclass(frozen=True)
class Reading:
    """How samples are read from any store: what is missing, and in whose name faults are told."""

    name: str
    marks: tuple[Mark, ...] = ()  # values that stand for none
    missing_chunks: bool = False  # what cannot be read is missing


@dataclass(eq=False)
class ChunkedSource(ABC):
    """Samples of one level, whose chunks may be damaged."""

    layout: Layout
    stored_type: np.dtype
    stored_chunk: tuple[int, ...]  # samples along each stored axis that are decoded at once
    level: str  # in words: "level 2"
    reading: Reading
    unread: dict[str, str] = field(default_factory=dict, init=False)  # chunks that could not be read, and why
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__ |= state
        self._lock = threading.Lock()

    @cached_property
    def shape(self) -> Triple:
        """Numbers of samples (nz, ny, nx)."""
        return self.layout.spatial(self.layout.sizes)

    @cached_property
    def chunk_shape(self) -> Triple:
        """Numbers of samples (z, y, x) that are decoded at once."""
        z, y, x = (
            min(each, size) for each, size in zip(self.layout.spatial(self.stored_chunk), self.shape, strict=True)
        )
        return z, y, x

    @property
    def dtype(self) -> np.dtype:
        """Type of the samples."""
        return with_missing(self.stored_type) if self.reading.marks or self.reading.missing_chunks else self.stored_type

    @property
    @abstractmethod
    def bytes_read(self) -> int:
        """Bytes that have been read from the store so far."""

    @abstractmethod
    def fetch(self, index: tuple[int | slice, ...]) -> NDArray:
        """Return a part of the stored array, in native byte order; raise FileFault if a chunk cannot be read."""

    @property
    def shard_shape(self) -> tuple[int, ...]:
        """Samples along each stored axis that lie in one object of the store."""
        return self.stored_chunk

    def stored_bytes(self) -> int | None:
        """Return the bytes of the array in its store, all channels and times, or None where that is not known."""
        return None

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentence about the chunks that were missing so far."""
        if not self.unread:
            return ()
        first, reason = next(iter(self.unread.items()))
        count = f"{len(self.unread)} chunk{'s' if len(self.unread) > 1 else ''}"
        of = f"{self.reading.name}: {self.level}"
        return (f"{of}: {count} could not be read and count as missing; the first is {first}: {reason}",)

    def read(self, box: Box) -> NDArray:
        """Return the samples of a box; raise InputError, which names the chunk, if it cannot be read."""
        return self.received(box, lambda: self.fetch(self.layout.stored(box)))

    def received(self, box: Box, fetch: Callable[[], NDArray]) -> NDArray:
        """Return the samples of a box that `fetch` gets as they are stored, or else what its chunks have."""
        try:
            return self._marked(self.layout.turned(fetch()))
        except ServerFault as fault:
            raise InputError(f"{self.reading.name}: {self.level}: {fault}") from None
        except FileFault:
            return self._by_chunks(box)

    def _by_chunks(self, box: Box) -> NDArray:
        """Return the samples of a box, read chunk by chunk; what was unreadable may be readable now."""
        made = np.empty([part.stop - part.start for part in box], self.dtype)
        for part in _aligned(box, self.chunk_shape):
            inner = tuple(slice(p.start - b.start, p.stop - b.start) for p, b in zip(part, box, strict=True))
            try:
                made[inner] = self._marked(self.layout.turned(self.fetch(self.layout.stored(part))))
            except ServerFault as fault:
                raise InputError(f"{self.reading.name}: {self.level}: {fault}") from None
            except FileFault as fault:
                z, y, x = (each.start for each in part)
                self._tell(self.layout.chunk((z, y, x), self.stored_chunk), str(fault))
                made[inner] = np.nan
        return made

    def _tell(self, chunk: str, reason: str) -> None:
        """Keep what is missing, or raise InputError where missing chunks are not allowed."""
        if not self.reading.missing_chunks:
            hint = "; --missing-chunks (--add-missing-chunks if it is of --add) draws such chunks as missing"
            raise InputError(f"{self.reading.name}: {self.level}: {chunk} cannot be read: {reason}{hint}")
        with self._lock:
            if not self.unread:
                remarks.make_at_end(self)
            self.unread.setdefault(chunk, reason)

    def _marked(self, part: NDArray) -> NDArray:
        if part.dtype == np.bool_:
            part = part.view(np.uint8)
        if self.dtype == self.stored_type and not self.reading.marks:
            return np.ascontiguousarray(part, self.stored_type)
        made = part.astype(self.dtype)
        for mark in self.reading.marks:
            made[part == mark] = np.nan
        return made


def with_missing(dtype: np.dtype) -> np.dtype:
    """Return the type of such samples where some are missing: float32, or float64 where that has not the digits."""
    if dtype.kind == "f":
        return dtype
    return np.dtype(np.float32 if dtype.itemsize * 8 <= _EXACT_BITS else np.float64)


def sample_type(dtype: np.dtype, name: str) -> np.dtype:
    """Return the type of samples in memory for a stored type, or raise FileFault if they are no real numbers."""
    if dtype.kind == "b":
        return np.dtype(np.uint8)
    if dtype.kind in "iuf" and dtype.itemsize <= 8 and dtype.type.__module__ == "numpy":
        return dtype.newbyteorder("=")
    raise FileFault(f"must hold real numbers of at most 64 bits, got type {name}")


def check_sizes(sizes: Sequence[int]) -> None:
    """Raise FileFault if an array has no sample, or more than numbers of 64 bits count."""
    if min(sizes, default=0) < 1 or math.prod(sizes) >= 2**60:
        raise FileFault(f"every dimension must be positive, and not absurd, got {' x '.join(map(str, sizes))}")


def check_chunks(layout: Layout, chunk: Sequence[int]) -> None:
    """Raise FileFault if a level has more chunks than can be told apart."""
    pairs = zip(layout.spatial(layout.sizes), layout.spatial(chunk), strict=True)
    counts = [-(-size // max(one, 1)) for size, one in pairs]
    if max(counts) > _MOST_ALONG or math.prod(counts) > _MOST_CHUNKS:
        found = " x ".join(map(str, counts[::-1]))
        raise FileFault(f"must have at most {_MOST_ALONG} chunks along an axis and {_MOST_CHUNKS} in all, got {found}")


def _aligned(box: Box, chunk: Triple) -> Iterator[Box]:
    """Yield the parts of a box that lie in one chunk each."""
    ranges = []
    for part, size in zip(box, chunk, strict=True):
        cuts = [part.start, *range((part.start // size + 1) * size, part.stop, size), part.stop]
        ranges.append([slice(low, high) for low, high in itertools.pairwise(cuts) if low < high])
    return ((z, y, x) for z, y, x in itertools.product(*ranges))
