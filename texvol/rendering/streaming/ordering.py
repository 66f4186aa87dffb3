"""Regions of a picture: which of them show anything, in which order, and from which level.

Front to back; in modes mip and minip those first that may hold the largest or least value, as the store knows it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.projection import SIGN_OF_LARGEST
from texvol.rendering.settings import Settings
from texvol.rendering.streaming.extremes import StoreBounds, groups_of
from texvol.rendering.streaming.levels import coarsest_by_pixels, levels_by_error, levels_by_pixels
from texvol.rendering.streaming.visibility import beyond_chunks, needed_chunks, regions_that_show, shown_box
from texvol.scene.large_volume import Box, LargeVolume
from texvol.scene.lighting import Lighting
from texvol.scene.scene import CompleteScene
from texvol.slicing import bricks
from texvol.slicing.bricks import Brick, Triple
from texvol.slicing.regions import Region, brick_of, margin_of

Size = tuple[int, int]


@dataclass
class Drawn:
    """Counts of a picture's regions that were drawn, hidden and empty, and their levels."""

    regions: int = 0
    drawn: int = 0
    hidden: int = 0  # behind opaque matter, and not read
    empty: int = 0  # known to show nothing, and not read
    by_level: dict[int, int] = field(default_factory=dict)  # regions drawn of each level
    moved: float | None = None  # by coarse levels at most, as predicted, where an error decides them


@dataclass
class KnownLevels:
    """Levels of regions, and how far they are predicted to move the picture, where an error decides them."""

    of_regions: dict[Region, int] = field(default_factory=dict)
    moved: float | None = None


class RegionsOfPicture:
    """Regions that a picture shows, in order, and their levels; the volume is drawn `alone` or beside others."""

    def __init__(
        self, scene: CompleteScene, size: Size, settings: Settings, volume: LargeVolume, alone: bool = True
    ) -> None:
        self.levels = KnownLevels()
        self._at: dict[Triple, Region] = {}  # shown regions
        self._bricks: dict[tuple[Region, int], Brick] = {}
        self._shown: dict[tuple[Triple, Triple], NDArray[np.float64] | None] = {}
        self.scene, self.size, self.settings, self.volume = scene, size, settings, volume
        self._reach = scene.gradient.reach if scene.needs_gradient else 0
        self.margin = margin_of(volume, scene.camera, size, settings.slab_thickness, self._reach)
        # Between the ends of a slab `integrated` shows what lies anywhere in it, and so do pieces of slabs.
        is_integrated = scene.mode == "composite" and scene.classification == "integrated"
        self.sees_between = is_integrated or volume.nearest or not alone
        self.beyond = self.margin if self.sees_between else np.zeros(3)
        if scene.mode == "isosurface":
            coarsest = volume.levels[coarsest_by_pixels(scene, size, settings, volume)]
            self.beyond = self.margin - self._reach + beyond_chunks(coarsest)
        # See `brick_of`. Regions of several volumes end between their samples.
        self.goes_on = scene.mode != "composite" or not alone
        sign = SIGN_OF_LARGEST.get(scene.mode)
        self.value_bounds = None if sign is None else StoreBounds(volume, sign)
        self.bounds: dict[Triple, float] = {}  # in modes mip and minip, of the shown regions by position

    def in_order(self, regions: list[Region]) -> tuple[list[Region], Drawn]:
        """Return the regions that may show anything, in the order in which they are drawn."""
        drawn = self.show(regions)
        ordered = bricks.visibility_order([self.brick(each, 0) for each in self.shown], self.volume, self.scene.camera)
        order = [self._at[brick.position] for brick in ordered]
        if self.value_bounds is not None:
            bounds = {each.position: self.value_bounds.of_brick(self.brick(each, self.level(each))) for each in order}
            self.bounds = {position: bound for position, bound in bounds.items() if not np.isnan(bound)}
            groups = groups_of(self.bounds)
            order = sorted((each for each in order if each.position in groups), key=lambda each: groups[each.position])
            drawn.empty = len(regions) - len(order)
        return order, drawn

    def show(self, regions: list[Region]) -> Drawn:
        """Find the regions that may show anything, which are `shown` then, and their levels."""
        shown = regions_that_show(self.scene, self.size, self.volume, regions, self.margin, self.beyond)
        drawn = Drawn(len(regions), empty=len(regions) - len(shown))
        error = self.settings.level_error
        if error is None:
            found = levels_by_pixels(self.scene, self.size, self.settings, self.volume, shown)
            self.levels.of_regions |= dict(zip(shown, found, strict=True))
        elif not self.levels.of_regions.keys() >= set(shown) or self.levels.moved is None:
            by_error = levels_by_error(self.scene, self.size, self.volume, shown, error)
            # Those that are known stay, so that pictures can be compared.
            known = dict(zip(shown, by_error.levels, strict=True)) | self.levels.of_regions
            self.levels.of_regions.update(known)
            self.levels.moved = max(by_error.moved, self.levels.moved or 0.0)
        drawn.moved = self.levels.moved
        self._at = {region.position: region for region in shown}
        return drawn

    @property
    def shown(self) -> list[Region]:
        """Regions that may show anything, in no order."""
        return list(self._at.values())

    def level(self, region: Region) -> int:
        """Return the level of a region that is shown."""
        return self.levels.of_regions[region]

    def brick(self, region: Region, level: int) -> Brick:
        """Return a region as a brick of a level."""
        if (region, level) not in self._bricks:
            # `integrated` looks at values anywhere in a slab, and shows what is between them.
            shown = None if level or self.sees_between else self.shown_samples(region.first, region.last)
            if shown is not None:
                shown = shown + np.outer([-1, 1], np.ceil(self.margin) + 1)
            of_level = self.volume.levels[level], level, self.volume.dimensions
            self._bricks[region, level] = brick_of(region, *of_level, self.margin_of(level), shown, self.goes_on)
        return self._bricks[region, level]

    def margin_of(self, level: int) -> NDArray[np.float64]:
        """Return the margin of a region of a level, in samples of level 0: gradients reach over its own samples."""
        margin: NDArray[np.float64] = self.margin + self._reach * (np.array(self.volume.levels[level].factor) - 1)
        return margin

    def needed(self, number: int) -> NDArray[np.bool_] | None:
        """Return which chunks of a level may matter, shape (cz, cy, cx); None where nothing is known."""
        needed = needed_chunks(self.scene, self.volume, number, self.beyond)
        coarse = None if number else self._of_coarse
        if coarse is None:
            return needed
        return ~coarse if needed is None else needed & ~coarse

    @cached_property
    def _of_coarse(self) -> NDArray[np.bool_] | None:
        """Chunks of level 0 that only regions of coarse levels show; None if levels do not depend on an error."""
        if self.settings.level_error is None:
            return None
        source = self.volume.levels[0].source
        coarse = np.zeros([-(-n // c) for n, c in zip(source.shape, source.chunk_shape, strict=True)], np.bool_)
        for region in sorted(self._at.values(), key=lambda each: self.level(each), reverse=True):
            coarse[_chunks(region.first, region.last, source.chunk_shape)] = self.level(region) > 0
        return coarse

    def left_to_coarse(self, brick: Brick) -> tuple[Box, ...]:
        """Return the boxes of samples, along z, y, x, in which a brick of the finest level continues beyond itself.

        They are in chunks that only coarse levels show, and that are not read.
        """
        coarse = None if brick.level else self._of_coarse
        if coarse is None:
            return ()
        shape = self.volume.levels[0].source.chunk_shape
        where = _chunks(brick.stored_first, brick.stored_last, shape)
        places = np.argwhere(coarse[where]) + [part.start for part in where]
        ends = list(zip(brick.stored_first[::-1], brick.stored_last[::-1], shape, strict=True))
        boxes = []
        for place in places.tolist():
            z, y, x = (slice(max(i * n, a), min((i + 1) * n, b)) for i, (a, b, n) in zip(place, ends, strict=True))
            boxes.append((z, y, x))
        return tuple(boxes)

    def continued(self, brick: Brick, values: NDArray) -> NDArray:
        """Return a part's samples with its outermost ones in place of those that are left to coarse levels."""
        start = np.array(brick.stored_first[::-1])
        own = [(a, b - 1) for a, b in zip(brick.first[::-1], brick.last[::-1], strict=True)]
        for box in self.left_to_coarse(brick):
            nearest = (np.clip(np.arange(part.start, part.stop), *ends) for part, ends in zip(box, own, strict=True))
            into = tuple(slice(part.start - a, part.stop - a) for part, a in zip(box, start, strict=True))
            values[into] = values[np.ix_(*(each - a for each, a in zip(nearest, start, strict=True)))]
        return values

    def shown_samples(self, first: Triple, last: Triple) -> NDArray[np.float64] | None:
        """Return the box of chunks that show anything from one sample of level 0 to another: see `shown_box`."""
        if (first, last) not in self._shown:
            reach = np.ceil(self.margin).astype(int)
            self._shown[first, last] = shown_box(self.scene, self.volume, first - reach, last + reach)
        return self._shown[first, last]


def _chunks(first: Triple, last: Triple, shape: Triple) -> Box:
    """Return the chunks, along z, y, x, that hold the samples first … last - 1, along x, y, z."""
    z, y, x = (slice(a // n, -(-b // n)) for a, b, n in zip(first[::-1], last[::-1], shape, strict=True))
    return z, y, x


def with_settled_light(scene: CompleteScene) -> CompleteScene:
    """Return the scene whose light does not depend on the values of a part of the volume."""
    lighting = scene.lighting or (Lighting() if scene.mode == "isosurface" else None)
    if lighting is None or lighting.fade is not None:
        return scene
    known: CompleteScene | None = scene.__dict__.get("_settled_light")
    if known is None:
        known = replace(scene, lighting=replace(lighting, fade=lighting.fade_for(scene.volume)))
        object.__setattr__(scene, "_settled_light", known)
    return known
