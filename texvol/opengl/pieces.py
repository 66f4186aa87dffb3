"""Pieces in which a frame is drawn: all at once if that is quick, or tiles one after the other.

Operating systems take the device from a program whose drawing does not end for some seconds, and nothing is heard of
ctrl-C before it ends. So what takes longer than half a second, by what a slab took of a pixel when the same program
drew last, is drawn in tiles of a quarter of a second, each waited for. Where somebody hears the progress, as the window
does, pieces are shorter, and there are always some.

The picture is the same bit for bit, because pixels do not depend on each other.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Iterator

from texvol.util import progress

Region = tuple[int, int, int, int]  # x, y, width, height in pixels, from the lower left corner
Regions = tuple[Region, ...]

LONG = 0.5  # seconds of a frame that is drawn in tiles
_TILE = 0.25  # seconds of a tile: a frame has a few of them
_HEARD = 0.015  # seconds of a tile where somebody hears the progress: a tenth of a noticeable delay
_UNKNOWN = 2e-8  # seconds of a slab of a pixel that was never timed: two busy cores and a lit medium
_FEWEST = 16  # pixels along a side of a tile: with fewer, setting up costs more than drawing
_GROWTH = 4.0  # of a tile's pixels from one to the next: the first may be empty
_MOST_KINDS = 256  # whose pace is remembered


class Pieces:
    """Pieces of frames on one context; `finish` waits until everything asked for is drawn."""

    def __init__(self, finish: Callable[[], None]) -> None:
        self._finish = finish
        self._pace: dict[Hashable, float] = {}  # seconds of a slab of a pixel
        self._begin, self._queued = 0.0, 0.0
        self._at_once: dict[Hashable, float] = {}  # slabs of pixels in this picture that were not timed

    def begin(self) -> None:
        """Begin a picture."""
        self._begin, self._queued, self._at_once = time.perf_counter(), 0.0, {}

    def end(self) -> None:
        """Learn from a picture that is finished and took long all the same; its textures are counted for drawing."""
        seconds, slabs = time.perf_counter() - self._begin, sum(self._at_once.values())
        if seconds > LONG and slabs:
            for kind in self._at_once:
                self._remember(kind, seconds / slabs)
        self._at_once = {}

    def of(
        self, regions: Regions | None, size: tuple[int, int], kind: Hashable, slabs: float
    ) -> Iterator[Region | None]:
        """Yield what is drawn next; None is the whole target.

        Parameters
        ----------
        regions : tuple of regions, optional
            Parts of the target that are drawn; None for all of it.
        size : (width, height)
            Pixels of the target.
        kind : hashable
            Program and switches: pixels of one kind take about as long.
        slabs : float
            Number of slabs that a ray may cross.
        """
        parts = ((0, 0, *size),) if regions is None else regions
        slabs = max(slabs, 1.0) * max(sum(width * height for _, _, width, height in parts), 1)
        seconds = slabs * self._pace.get(kind, _UNKNOWN)
        if progress.is_heard() or seconds > LONG:
            yield from self._tiles(parts, kind, slabs, seconds)
            return
        if self._queued + seconds > LONG:  # of bricks before this one
            self._wait()
        self._queued += seconds
        self._at_once[kind] = self._at_once.get(kind, 0.0) + slabs
        yield from (None,) if regions is None else regions

    def _tiles(self, parts: Regions, kind: Hashable, slabs: float, seconds: float) -> Iterator[Region]:
        """Yield tiles of all parts, and tell the progress once each is drawn."""
        longest = _HEARD if progress.is_heard() else _TILE
        pixels = sum(width * height for _, _, width, height in parts)
        # A device that was never timed may be a hundred times slower than others.
        wanted = pixels * longest / seconds if kind in self._pace else float(_FEWEST**2)
        progress.advance(0)
        self._wait()
        begin = time.perf_counter()
        for x, y, width, height in parts:
            row = 0
            while row < height:
                rows, column = min(max(int(wanted // width), _FEWEST), height - row), 0
                while column < width:
                    across = min(max(int(wanted // rows), _FEWEST), width - column)
                    start = time.perf_counter()
                    yield x + column, y + row, across, rows
                    self._finish()
                    of_wanted = (time.perf_counter() - start) * wanted / (rows * across)
                    wanted = max(wanted * min(longest / max(of_wanted, 1e-9), _GROWTH), 1.0)
                    progress.within(rows * across / pixels)
                    column += across
                row += rows
        self._remember(kind, (time.perf_counter() - begin) / slabs)

    def _wait(self) -> None:
        self._finish()
        self._queued = 0.0

    def _remember(self, kind: Hashable, pace: float) -> None:
        if len(self._pace) >= _MOST_KINDS:
            self._pace.clear()
        self._pace[kind] = pace
