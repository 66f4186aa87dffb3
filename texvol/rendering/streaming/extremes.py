"""Regions and chunks that cannot change a picture of mip or minip: they are not read.

A store's statistics bound the values of a region, and of a chunk and the samples around it. Regions are drawn in the
order of their bounds, those first that may hold the largest value of all (in minip the least; all values here are times
a sign with which that is the largest). Where every ray that comes to a region or chunk has met at least its bound
nothing in it matters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.collected import CollectedNumbers
from texvol.opengl.compositor import Compositor
from texvol.rendering.streaming.visibility import Box, Places
from texvol.rendering.visible_rays import visible_rays
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene
from texvol.slicing.bricks import Brick, Triple
from texvol.slicing.coverage import in_common, pixel_boxes_of, pixels_of
from texvol.slicing.slabs import WHOLE_BOX

Numbers = NDArray[np.float64]
# Of the largest magnitude: what is drawn of equal samples may be so far below them, as in opengl/value_bounds.py. What
# is larger than a ray has met by that alone is not looked for.
_SAME = 2.0**-22
_GROUPS = 16  # of regions of similar bounds
_BLOCKS = 4  # blocks of pixels along a side of the box of pixels that a chunk covers, in whose least a ray is looked up


class StoreBounds:
    """Bounds of the values in a store, times a sign with which they are compared."""

    def __init__(self, volume: LargeVolume, sign: float) -> None:
        self._volume, self._sign = volume, sign
        self._levels: dict[int, tuple[Numbers, Numbers] | None] = {}

    def of_brick(self, brick: Brick) -> float:
        """Return the bound of all that a brick stores: infinite where nothing is known, NaN where all are missing."""
        known = self._of_level(brick.level)
        if known is None:
            return np.inf
        chunk = self._volume.levels[brick.level].source.chunk_shape
        ends = zip(brick.stored_first[::-1], brick.stored_last[::-1], chunk, strict=True)
        chunks = tuple(slice(a // n, -(-b // n)) for a, b, n in ends)
        bound = float(np.fmax.reduce(known[0][chunks], axis=None))
        return np.inf if bound == -np.inf else bound  # which is met where nothing was met before

    def around_chunks(self, level: int, places: Places) -> Numbers:
        """Return the bounds of chunks and the next samples around them; infinite where nothing may stand for a chunk.

        `places` are those in the grid of the level, along z, y, x, shape (n, 3).
        """
        known = self._of_level(level)
        return np.full(len(places), np.inf) if known is None else known[1][tuple(places.T)]

    def _of_level(self, number: int) -> tuple[Numbers, Numbers] | None:
        """Return the bounds of the chunks of a level, and with the next samples around."""
        if number not in self._levels:
            self._levels[number] = self._found(number)
        return self._levels[number]

    def _found(self, number: int) -> tuple[Numbers, Numbers] | None:
        level = self._volume.levels[number]
        statistics = level.statistics
        if statistics is None or tuple(statistics.chunk_shape) != tuple(level.source.chunk_shape):
            return None
        ends = (statistics.minimum, statistics.maximum)
        slack = _SAME * max(float(np.abs(each[np.isfinite(each)]).max(initial=0.0)) for each in ends)
        own, around = statistics.maximum, statistics.highest_around
        if self._sign < 0:
            own, around = -statistics.minimum, -statistics.lowest_around
        return own - slack, np.where(np.isnan(own) | (around == -np.inf), np.inf, around) - slack


def groups_of(bounds: Mapping[Triple, float]) -> dict[Triple, int]:
    """Return the group of each region by its position: regions are drawn group after group.

    Those of one group have similar bounds, and are drawn from neighbour to neighbour, which have chunks in common.
    """
    ascending = np.sort([-bound for bound in bounds.values()])
    return {at: int(np.searchsorted(ascending, -bound)) * _GROUPS // len(bounds) for at, bound in bounds.items()}


class KnownExtremes:
    """Values that the rays of a picture have met, and bounds of those that they may meet.

    Parameters
    ----------
    bounds : StoreBounds
    of_regions : mapping
        Bound of each region by its position.
    collected : CollectedNumbers
        What the rays have met.
    """

    def __init__(
        self,
        scene: CompleteScene,
        size: tuple[int, int],
        bounds: StoreBounds,
        of_regions: Mapping[Triple, float],
        collected: CollectedNumbers,
    ) -> None:
        self._scene, self._size, self._bounds = scene, size, bounds
        self._of_regions, self._collected = of_regions, collected
        self._passes = _rays_that_pass(scene, size)
        self._known: dict[Triple, tuple[tuple[slice, slice], NDArray[np.bool_]]] = {}
        self._least: list[Numbers] | None = None  # of blocks of 1, 2, 4, … pixels along a side
        self.hidden = 0

    def hides(self, brick: Brick) -> bool:
        """True if no ray that comes to a brick has met less than its bound; it counts as hidden then."""
        bound = self._of_regions[brick.position]
        if bound == np.inf:
            return False
        where, mask = self._pixels(brick)
        if (self._collected.largest[where][mask] < bound).any():
            return False
        self.hidden += 1
        return True

    def may_hide(self, brick: Brick, before: Sequence[Brick]) -> bool:
        """True if others of larger bounds cover all pixels of a brick in which it may matter yet."""
        bound = self._of_regions[brick.position]
        if bound == np.inf:
            return False
        where, mask = self._pixels(brick)
        matters = mask & (self._collected.largest[where] < bound)
        for each in before:
            if not self._of_regions[each.position] > bound:
                continue
            own, covers = self._pixels(each)
            if (common := in_common(where, own)) is not None:
                here, there = common
                matters[here] &= ~covers[there]
        return not matters.any()

    @property
    def tells_chunks(self) -> bool:
        """True if any ray has met a value."""
        return bool(self._collected.is_met.any())

    def are_hidden(self, level: int, places: Places, parts: Box) -> NDArray[np.bool_]:
        """Return which chunks no ray comes to that has met less than their bounds."""
        low, high = pixel_boxes_of(self._scene.volume, self._scene.camera, self._size, parts)
        bounds = self._bounds.around_chunks(level, places)
        return np.asarray((self._least_within(low, high) >= bounds) & (bounds < np.inf))

    def has_drawn(self, compositor: Compositor, brick: Brick, values: tuple[float, float] | None) -> None:
        """Forget what was known before a brick was drawn."""
        self._least = None

    def _pixels(self, brick: Brick) -> tuple[tuple[slice, slice], NDArray[np.bool_]]:
        """Return rows and columns around the pixels of a brick, and which of these may show it."""
        if brick.position not in self._known:
            part = np.clip(brick.stored_box, 0, 1)
            where, mask = pixels_of(self._scene.volume, self._scene.camera, self._size, part)
            self._known[brick.position] = where, mask & self._passes[where]
        return self._known[brick.position]

    def _least_within(self, low: Places, high: Places) -> Numbers:
        """Return the least of what rays have met in boxes of pixels, or in some more around; infinite in empty ones.

        `low` and `high` are the first column and row, and those behind the last, both of shape (n, 2).
        """
        if self._least is None:
            self._least = _pyramid_of_least(self._collected.largest, self._passes)
        sides = np.maximum((high - low).max(axis=1), 1)
        steps = np.clip(np.ceil(np.log2(sides / _BLOCKS)).astype(int), 0, len(self._least) - 1)
        found = np.full(len(low), np.inf)
        for step in np.unique(steps):
            of_step, blocks = steps == step, self._least[step]
            first, last = low[of_step] >> step, (high[of_step] - 1) >> step
            is_empty = (high[of_step] <= low[of_step]).any(axis=1)
            least = np.full(len(first), np.inf)
            for row in range(int((last - first)[:, 1].max(initial=0)) + 1):
                for column in range(int((last - first)[:, 0].max(initial=0)) + 1):
                    x, y = np.clip(first + (column, row), 0, np.minimum(last, np.subtract(blocks.shape[::-1], 1))).T
                    np.minimum(least, blocks[y, x], out=least, where=~is_empty)
            found[of_step] = least
        return found


def _pyramid_of_least(largest: Numbers, passes: NDArray[np.bool_]) -> list[Numbers]:
    """Return what each ray has met, and the least of blocks of 2, 4, … pixels along a side; infinite without any."""
    levels = [np.where(passes, largest, np.inf)]
    while max(levels[-1].shape) > 1:
        coarser = levels[-1]
        for _ in range(2):  # along rows and columns, each of which is the first axis in its turn
            pairs = coarser[::2].copy()
            np.minimum(pairs[: len(coarser) // 2], coarser[1::2], out=pairs[: len(coarser) // 2])
            coarser = pairs.T
        levels.append(coarser)
    return levels


def _rays_that_pass(scene: CompleteScene, size: tuple[int, int]) -> NDArray[np.bool_]:
    """Return which rays come to what clip planes and crop box leave of the volume, or nearly so, (height, width)."""
    volume, camera = scene.volume, scene.camera
    if scene.cutting:
        eyes, directions = (each.reshape(-1, 3) for each in camera.rays(size))
        rays = visible_rays(scene, eyes, directions)
        return (rays.first <= rays.last + _SAME * volume.radius).reshape(size[::-1])
    passes = np.zeros(size[::-1], np.bool_)
    where, mask = pixels_of(volume, camera, size, WHOLE_BOX)
    passes[where] = mask
    return passes
