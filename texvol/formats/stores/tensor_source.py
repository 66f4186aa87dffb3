"""Samples of a Zarr array, read by TensorStore: a box in one call, whose chunks are decoded in parallel."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import FileFault
from texvol.formats.stores.access import bytes_so_far, waited
from texvol.formats.stores.sources import ChunkedSource, Layout, Reading, check_chunks, check_sizes, sample_type
from texvol.scene.large_volume import Box

_MOST_FILES = 20_000  # whose sizes are asked for: a fraction of a second
# Types that numpy does not have, and the smallest one that holds their values.
_WIDENED = {"bfloat16": np.float32, "int4": np.int8, "int2": np.int8}


class _Meter:
    """Bytes of all stores of the process, each byte counted for the source that is asked next how many it has read.

    TensorStore counts for the process, not for an array: the sum of all sources is exact.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._counted: int | None = None

    def start(self) -> None:
        """Begin to count, if nothing is counted yet."""
        with self._lock:
            if self._counted is None:
                self._counted = bytes_so_far()

    def since_last(self) -> int:
        """Return the bytes that nobody has counted yet."""
        with self._lock:
            now = bytes_so_far()
            new, self._counted = now - (self._counted or 0), now
            return new


_METER = _Meter()


@dataclass(frozen=True)
class PendingBox:
    """Samples of a box that are being read in the background."""

    source: TensorSource
    box: Box
    future: Any

    def done(self) -> bool:
        """Return True if `result` does not have to wait."""
        return bool(self.future.done())

    def result(self) -> NDArray:
        """Wait for the samples and return them; raise InputError if a chunk cannot be read."""
        return self.source.finish(self.box, self.future)


@dataclass(eq=False)
class TensorSource(ChunkedSource):
    """Samples of a TensorStore."""

    store: Any
    check_alive: Callable[[], None] | None  # None: its samples are in files
    _bytes: int = 0

    @classmethod
    def of(
        cls, store: Any, layout: Layout, level: str, reading: Reading, check_alive: Callable[[], None] | None
    ) -> TensorSource:
        """Return the samples of an open TensorStore; raise FileFault if these are no real numbers."""
        check_sizes(store.shape)
        name = store.dtype.name
        wide = np.float32 if name.startswith("float8") else _WIDENED.get(name)
        dtype = np.dtype(wide) if wide else sample_type(np.dtype(store.dtype.numpy_dtype), name)
        shape = store.chunk_layout.read_chunk.shape or store.shape
        chunk = tuple(int(each) or size for each, size in zip(shape, store.shape, strict=True))
        check_chunks(layout, chunk)
        _METER.start()
        return cls(layout, dtype, chunk, level, reading, store, check_alive)

    @property
    def bytes_read(self) -> int:
        """Bytes that have been read from the store so far."""
        with self._lock:
            self._bytes += _METER.since_last()
            return self._bytes

    @property
    def shard_shape(self) -> tuple[int, ...]:
        """Samples along each stored axis that lie in one object of the store."""
        return tuple(int(each) for each in self.store.chunk_layout.write_chunk.shape)

    def stored_bytes(self) -> int | None:
        """Return the bytes of the array's files, unless these are too many to be looked at, or on a server."""
        where = self.store.kvstore
        if where is None or where.spec().to_json().get("driver") != "file":
            return None
        total, seen = 0, 0
        for folder, _, names in os.walk(where.path):
            seen += len(names)
            if seen > _MOST_FILES:
                return None
            paths = (os.path.join(folder, each) for each in names)
            total += sum(os.path.getsize(each) for each in paths if os.path.isfile(each))
        return total

    def fetch(self, index: tuple[int | slice, ...]) -> NDArray:
        """Return a part of the array; raise FileFault if a chunk cannot be read."""
        return self._received(self.store[index].read(order="C"))

    def begin(self, box: Box) -> PendingBox:
        """Begin to read the samples of a box; TensorStore reads and decodes them in threads of its own."""
        return PendingBox(self, box, self.store[self.layout.stored(box)].read(order="C"))

    def finish(self, box: Box, future: Any) -> NDArray:
        """Return the samples of a box that are being read; raise InputError, as `read` does."""
        return self.received(box, lambda: self._received(future))

    def _received(self, future: Any) -> NDArray:
        try:
            found = np.asarray(waited(future, check_alive=self.check_alive, of_files=self.check_alive is None))
        except MemoryError:
            raise FileFault("needs more memory than there is") from None
        return found.astype(self.stored_type) if found.dtype.kind not in "iufb" or not found.dtype.isnative else found
