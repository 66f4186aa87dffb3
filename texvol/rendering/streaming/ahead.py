"""Parts of a picture in the order in which they are drawn: the next ones are read and prepared by threads meanwhile."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Generator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import partial
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.part_store import Part, PartStore, Prepared
from texvol.rendering.streaming.assembly import Assembly
from texvol.rendering.streaming.parts import PictureOfParts
from texvol.rendering.streaming.sample_cache import SampleCache
from texvol.rendering.streaming.visibility import AHEAD, Hiding
from texvol.slicing.bricks import Brick
from texvol.slicing.regions import Region


@dataclass
class PendingPart:
    """A part that is about to be drawn: the brick, the same of the finest level, and what is being prepared."""

    finest: Brick
    brick: Brick
    assembly: Assembly | None = None  # None: it was on the device when it was looked for
    prepared: Future[Prepared] | None = None


class PartsAhead:
    """Threads that prepare parts, and what they need of one volume; to be used by one thread."""

    def __init__(self, cache: SampleCache, parts: PartStore) -> None:
        self._cache, self._parts = cache, parts
        self._pool = ThreadPoolExecutor(min(AHEAD, os.cpu_count() or 1), "texvol-prepare")

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown(wait=True, cancel_futures=True)

    def in_order(
        self, order: list[Region], screen: Hiding, picture: PictureOfParts
    ) -> Generator[PendingPart, None, None]:
        """Yield the parts that are to be drawn, in order.

        Raises
        ------
        NoRoomError
            If the budget has no room for one part.
        """
        waiting, ahead = deque(order), deque[PendingPart]()
        try:
            while waiting or ahead:
                while waiting and len(ahead) < AHEAD:
                    region = waiting[0]
                    finest = picture.brick(region, 0)
                    if screen.hides(finest):
                        waiting.popleft()
                        self._pass_by(region, picture)
                        continue
                    if ahead and screen.may_hide(finest, [each.finest for each in ahead]):
                        break  # read only once it is known to be seen
                    brick = picture.brick(region, picture.level(region))
                    pending = PendingPart(finest, brick)
                    if self.known(pending, picture) is None and not self._ask(pending, screen, picture, bool(ahead)):
                        break
                    ahead.append(pending)
                    waiting.popleft()
                if ahead:
                    yield ahead.popleft()
        finally:
            for each in ahead:
                self.forget(each)

    def known(self, pending: PendingPart, picture: PictureOfParts) -> Part | None:
        """Return the part if it is on the device."""
        return self._parts.known(
            pending.brick, picture.texels(pending.brick), picture.scene.classification, picture.view
        )

    def part(self, pending: PendingPart, screen: Hiding, picture: PictureOfParts, everything: bool) -> Part:
        """Return the part on the device, when it has been prepared; `everything` as for `PartStore.added`.

        Raises
        ------
        InputError
            If a chunk cannot be read.
        NoRoomError
            If the budget has no room for the part.
        """
        known = self.known(pending, picture) if pending.prepared is None else None
        if known is not None:
            return known
        if pending.prepared is None:  # it had to go for others
            self._ask(pending, screen, picture, False)
        assert pending.prepared is not None and pending.assembly is not None
        start = None if pending.prepared.done() else perf_counter()
        try:
            prepared = pending.prepared.result()
            if start is not None:
                self._cache.reading.seconds_waited += perf_counter() - start
            texels = picture.texels(pending.brick)
            view = picture.view if pending.assembly.has_holes else ""
            return self._parts.added(pending.brick, texels, prepared, everything, view)
        finally:
            self.forget(pending)

    def _ask(self, pending: PendingPart, screen: Hiding, picture: PictureOfParts, may_fail: bool) -> bool:
        """Begin to read and prepare a part; return False if it may fail and there is no room for it now."""
        brick = pending.brick
        where = brick.level, brick.stored_first, brick.stored_last
        # Counts of slabs are added up and tell nothing of what is opaque.
        hidden = partial(_hidden, screen, picture) if screen.tells_chunks and not picture.drawing.count else None
        pending.assembly = self._cache.ask(*where, hidden, picture.leaves_gaps(brick.level))
        if pending.assembly is None:
            if may_fail:
                return False
            raise self._cache.no_room(*where)
        pending.prepared = self._pool.submit(self._prepared, pending.assembly, picture, brick)
        return True

    def _prepared(self, assembly: Assembly, picture: PictureOfParts, brick: Brick) -> Prepared:
        values = picture.continued(brick, assembly.values())
        volume = picture.volume.placed(assembly.level, assembly.first, values)
        return picture.prepared(volume, brick)

    def _pass_by(self, region: Region, picture: PictureOfParts) -> None:
        """Tell the samples that a region is not needed."""
        brick = picture.brick(region, picture.level(region))
        self._cache.pass_by(brick.level, brick.stored_first, brick.stored_last)

    def forget(self, pending: PendingPart) -> None:
        """Give back what a part holds, when its thread has ended."""
        if pending.prepared is not None and not pending.prepared.cancel():
            wait([pending.prepared])
        if pending.assembly is not None:
            self._cache.done(pending.assembly, reuse=True)
        pending.assembly = pending.prepared = None


def _hidden(screen: Hiding, picture: PictureOfParts, level: int, boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which chunks, boxes of samples of a level, (n, 2, 3) along x, y, z, would not change the picture."""
    own = picture.volume.levels[level]
    factor, first = np.array(own.factor), np.array(own.first)
    reach = picture.margin_of(level) + factor  # a sample is seen as far as the next one, half a slab and gradients
    low = first + factor * boxes[:, 0] - reach
    high = first + factor * (boxes[:, 1] - 1) + reach
    parts = (np.stack([low, high], axis=1) + 0.5) / np.array(picture.volume.dimensions)
    places = boxes[:, 0, ::-1].astype(np.intp) // own.source.chunk_shape
    return screen.are_hidden(level, places, np.clip(parts, 0.0, 1.0))
