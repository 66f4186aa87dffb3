"""Grid of a level's chunks."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.streaming.assembly import Ends, Piece
from texvol.scene.large_volume import Box, Level, Triple

Place = tuple[int, int, int]  # of a chunk in the grid, along z, y, x


class ChunkGrid:
    """Places and sizes of a level's chunks, and which of them matter."""

    def __init__(self, level: Level) -> None:
        self.source, self._statistics = level.source, level.statistics
        self.dtype, self.shape = level.source.dtype, level.source.chunk_shape
        self.ends: list[list[Ends]] = [
            [(at, min(at + n, count)) for at in range(0, count, n)]
            for n, count in zip(self.shape, level.source.shape, strict=True)
        ]
        self._lengths = [[b - a for a, b in ends] for ends in self.ends]
        self.needed: NDArray[np.bool_] | None = None  # chunks that matter, shape (cz, cy, cx); None: all

    def places(self, first: Triple, last: Triple) -> Box:
        """Return the chunks that hold the samples first … last - 1, along x, y, z, as slices of the grid."""
        z, y, x = (slice(a // n, -(-b // n)) for a, b, n in zip(first[::-1], last[::-1], self.shape, strict=True))
        return z, y, x

    def box(self, place: Place) -> Box:
        """Return the samples of a chunk."""
        z, y, x = (slice(*ends[at]) for ends, at in zip(self.ends, place, strict=True))
        return z, y, x

    def bytes(self, place: Place) -> int:
        """Return what a chunk takes."""
        along_z, along_y, along_x = self._lengths
        return along_z[place[0]] * along_y[place[1]] * along_x[place[2]] * self.dtype.itemsize

    def bytes_of_all(self, chosen: NDArray[np.bool_]) -> int:
        """Return what the chunks take that are chosen and matter."""
        matters = chosen if self.needed is None else chosen & self.needed
        return int(np.einsum("zyx,z,y,x", matters.astype(np.int64), *self._lengths)) * self.dtype.itemsize

    def unread(self, place: Place) -> Piece:
        """Return what stands for a chunk that is not read: its least value.

        Between that and the samples around nothing shows where nothing shows in the chunk, and no value is larger or
        less than any in the chunk and the samples around.
        """
        z, y, x = self.ends
        least = 0.0 if self._least is None else float(self._least[place])
        return Piece(z[place[0]], y[place[1]], x[place[2]], None, least)

    def around(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the chunks, some of a box of the grid, that are chosen or touch one that is, at a corner at least."""
        padded = np.pad(chosen, 1)
        for axis in range(3):
            along = np.moveaxis(padded, axis, 0)
            reached = padded.copy()
            reached_along = np.moveaxis(reached, axis, 0)
            reached_along[1:] |= along[:-1]
            reached_along[:-1] |= along[1:]
            padded = reached
        return padded[1:-1, 1:-1, 1:-1]

    @cached_property
    def _least(self) -> NDArray[np.float64] | None:
        if self._statistics is None:
            return None
        return self._statistics.minimum  # NaN of a chunk whose samples are all missing
