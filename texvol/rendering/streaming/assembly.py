"""Assembly: what the samples of a part are put together from, by any thread, when they have been read."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import Triple

Ends = tuple[int, int]  # first sample along an axis, and the one behind the last


class Pending(Protocol):
    """Samples that are being read in the background."""

    def done(self) -> bool:
        """Return True if `result` returns, or raises, at once."""

    def result(self) -> NDArray:
        """Wait for the samples and return them; raise InputError if a chunk cannot be read."""


@dataclass(frozen=True)
class InMemory:
    """Samples that need not be read."""

    values: NDArray

    def done(self) -> bool:
        """Return True."""
        return True

    def result(self) -> NDArray:
        """Return the samples."""
        return self.values


class Held:
    """A chunk in memory or on the way; methods may be called by any thread."""

    def __init__(self, pending: Pending) -> None:
        self._pending: Pending | None = pending
        self._values: NDArray | None = None
        self._lock = threading.Lock()

    @property
    def is_there(self) -> bool:
        """True if it is not on the way."""
        pending = self._pending
        return pending is None or pending.done()

    def samples(self) -> NDArray:
        """Wait for the samples and return them; raise InputError if the chunk cannot be read."""
        with self._lock:
            if self._pending is not None:
                self._values = self._pending.result()
                self._pending = None
            assert self._values is not None
            return self._values


class Piece(NamedTuple):
    """A box of samples, ends along each axis: a chunk, or, without `held`, samples that are all the `least` value."""

    z: Ends
    y: Ends
    x: Ends
    held: Held | None = None
    least: float = 0.0


@dataclass
class Assembly:
    """Pieces of the samples first … last - 1 of a level, along x, y, z; `bytes` is what they take."""

    level: int
    first: Triple
    last: Triple
    dtype: np.dtype
    pieces: Sequence[Piece]
    chunks: list[Any]  # that the cache has to keep until `done`
    bytes: int
    buffer: NDArray[np.uint8] | None  # memory that may be used
    has_holes: bool  # True if something was left out that could not be seen

    def values(self) -> NDArray:
        """Wait for the pieces and put them together; raise InputError if a chunk cannot be read."""
        start, stop = self.first[::-1], self.last[::-1]
        if self.buffer is None:
            self.buffer = np.empty(self.bytes, np.uint8)
        values = self.buffer[: self.bytes].view(self.dtype).reshape([b - a for a, b in zip(start, stop, strict=True)])
        (z0, y0, x0), (z1, y1, x1) = start, stop
        for (z, lz), (y, ly), (x, lx), held, least in self.pieces:
            # From and to where, counted from the first sample of the part.
            az, ay, ax = max(z, z0), max(y, y0), max(x, x0)
            bz, by, bx = min(lz, z1), min(ly, y1), min(lx, x1)
            into = values[az - z0 : bz - z0, ay - y0 : by - y0, ax - x0 : bx - x0]
            into[...] = least if held is None else held.samples()[az - z : bz - z, ay - y : by - y, ax - x : bx - x]
        return values
