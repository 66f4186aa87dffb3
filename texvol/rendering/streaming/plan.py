"""Plan of a picture of large volumes: what would be read, drawn and needed.

No part of it is read for that, but for a small level that predicts errors where one is asked for.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.settings import Settings, checked, numbers_asked_for
from texvol.rendering.streaming.kinds import all_in_parts, large_volumes, reason_for_memory
from texvol.rendering.streaming.levels import LevelsAskedFor, levels_beside, with_levels
from texvol.rendering.streaming.ordering import RegionsOfPicture
from texvol.scene.large_volume import LargeVolume, Level
from texvol.scene.picture_size import AnySize, checked_size
from texvol.scene.scene import CompleteScene, Scene
from texvol.slicing.bricks import Triple
from texvol.slicing.common_regions import common_regions
from texvol.slicing.regions import Region, regions_of_level
from texvol.slicing.slabs import slab_stacks
from texvol.util.errors import InputError
from texvol.util.numbers import AnyNumber
from texvol.util.upward import upward


@dataclass(frozen=True)
class Plan:
    """Bytes, slabs and memory that a picture takes at most: what is hidden is found out when it is drawn."""

    size: tuple[int, int]
    slabs: int | None  # None where a maximum error decides
    regions: int
    levels: dict[int, int]  # regions drawn of each level
    empty: int  # regions that are known to show nothing, or are off the screen or cut away
    chunks: int
    chunks_total: int  # of level 0
    bytes: int  # of the samples in these chunks
    bytes_total: int  # of all samples of level 0
    memory: int  # bytes that samples may take
    least_memory: int  # that one region with its margin and the chunks that it is in take
    level_error: float | None = None  # that coarse levels are predicted to have, where an error decides them

    @property
    def metadata(self) -> dict[str, Any]:
        """The plan in JSON types."""
        return dict(vars(self)) | {"size": list(self.size), "levels": {str(k): n for k, n in self.levels.items()}}

    @property
    def text(self) -> str:
        """The plan in lines for people."""
        levels = ", ".join(f"{count} of level {level}" for level, count in sorted(self.levels.items())) or "none"
        slabs = "as many slabs as the error needs" if self.slabs is None else f"{self.slabs} slabs"
        off = f", off by at most {upward(self.level_error)} by prediction" if self.level_error else ""
        return "\n".join(
            [
                f"draws   {sum(self.levels.values())} of {self.regions} regions ({levels}{off}; "
                f"{self.empty} show nothing), {self.size[0]} x {self.size[1]} pixels, {slabs}",
                f"reads   at most {self.chunks} chunks, {in_bytes(self.bytes)} of samples (level 0 has "
                f"{self.chunks_total} chunks, {in_bytes(self.bytes_total)}); less where others hide them",
                f"needs   {in_bytes(self.least_memory)} of memory at least, has {in_bytes(self.memory)} for samples",
            ]
        )


def plan(
    scene: Scene,
    size: AnySize = (512, 512),
    *,
    slab_thickness: AnyNumber | None = None,
    sampling_rate: AnyNumber | None = None,
    max_error: AnyNumber | None = None,
    level: int | str = "auto",
    level_error: AnyNumber | None = None,
) -> Plan:
    """Return what `Renderer.render` with the same arguments would read, draw and need of large volumes.

    Raises
    ------
    InputError
        If the scene is not of large volumes that can be drawn part by part, or an argument is out of range.
    """
    is_large = any(isinstance(volume, LargeVolume) for volume in scene.volumes)
    if (reason := reason_for_memory(scene, level=level)) is not None or not is_large:
        raise InputError(f"plan: needs a volume in a store that is drawn part by part, got {reason or 'one in memory'}")
    scene = all_in_parts(scene) if scene.added else scene
    size = checked_size(size)
    complete = scene.classified_as("post").completed(size) if scene.classification == "auto" else scene.completed(size)
    rates = numbers_asked_for(slab_thickness=slab_thickness, sampling_rate=sampling_rate, max_error=max_error)
    (level_error,), thickness = numbers_asked_for(level_error=level_error), checked(scene, *rates)
    settings = Settings(thickness, "auto", "rgba32f", 0.0, skip_empty=True)
    asked = LevelsAskedFor(level, level_error, rates[2], rates[0] or rates[1])
    settings = with_levels(complete, size, settings, asked)
    return _plan_of(complete, size, settings)


def _plan_of(scene: CompleteScene, size: tuple[int, int], settings: Settings) -> Plan:
    known = np.isfinite(settings.slab_thickness)  # NaN where an error decides: they are hardly ever thicker than this
    thickness = settings.slab_thickness if known else scene.smallest_spacing
    regions, empty, of_each = _regions_of_each(scene, size, replace(settings, slab_thickness=thickness))
    each = [_reading_of(picture, shown) for picture, shown in of_each]
    volumes = [picture.volume for picture, _ in of_each]
    return Plan(
        size,
        slab_stacks(scene.box, scene.camera, settings.slab_thickness, size).slab_count if known else None,
        regions,
        dict(sum((reading.levels for reading in each), Counter[int]())),
        empty,
        sum(reading.chunks for reading in each),
        sum(reading.chunks_total for reading in each),
        sum(reading.bytes for reading in each),
        sum(volume.levels[0].bytes for volume in volumes),
        min(volume.memory for volume in volumes),
        sum(reading.least for reading in each),
        of_each[0][0].levels.moved,
    )


def _regions_of_each(
    scene: CompleteScene, size: tuple[int, int], settings: Settings
) -> tuple[int, int, list[tuple[RegionsOfPicture, list[Region]]]]:
    """Return the number of regions, how many show nothing, and those that each volume is read in."""
    volumes = large_volumes(scene)
    if not scene.added:
        picture = RegionsOfPicture(scene, size, settings, volumes[0])
        regions = regions_of_level(volumes[0], settings.level)
        order, drawn = picture.in_order(regions)
        return len(regions), drawn.empty, [(picture, order)]
    levels = levels_beside(volumes, settings.level)
    pictures = [
        RegionsOfPicture(alone, size, replace(settings, level=level), volume, alone=False)
        for alone, volume, level in zip(scene.each_alone(), volumes, levels, strict=True)
    ]
    common = common_regions(volumes, levels, [picture.margin for picture in pictures])
    shown: set[Triple] = set()
    for picture, own in zip(pictures, common.own, strict=True):
        picture.show(list(own.values()))
        shown.update(region.position for region in picture.shown)
    return len(common.regions), len(common.regions) - len(shown), [(picture, picture.shown) for picture in pictures]


@dataclass(frozen=True)
class _Reading:
    """Counts of what is read of a volume at most: regions of each level, chunks of all levels, bytes of samples."""

    levels: Counter[int]
    chunks: int
    chunks_total: int  # of level 0
    bytes: int
    least: int  # bytes of memory that one region takes


def _reading_of(picture: RegionsOfPicture, regions: list[Region]) -> _Reading:
    volume = picture.volume
    numbered = list(enumerate(volume.levels))
    needed = [picture.needed(number) for number, _ in numbered]
    chunks = [np.zeros(-(-np.array(level.source.shape) // level.source.chunk_shape), np.bool_) for _, level in numbered]
    least, levels = 0, Counter[int]()
    for region in regions:
        number = picture.level(region)
        levels[number] += 1
        brick, own = picture.brick(region, number), volume.levels[number]
        ends = zip(brick.stored_first[::-1], brick.stored_last[::-1], own.source.chunk_shape, strict=True)
        where = tuple(slice(a // n, -(-b // n)) for a, b, n in ends)
        chunks[number][where] = True
        in_chunks = np.prod(
            [(part.stop - part.start) * n for part, n in zip(where, own.source.chunk_shape, strict=True)]
        )
        of_part = np.prod(np.array(brick.stored_last) - brick.stored_first)
        least = max(least, int(in_chunks + of_part) * volume.dtype.itemsize)
    read = [each if matters is None else each & matters for each, matters in zip(chunks, needed, strict=True)]
    samples = sum(_samples_of(each, level) for each, (_, level) in zip(read, numbered, strict=True))
    count = sum(int(each.sum()) for each in read)
    return _Reading(levels, count, chunks[0].size, samples * volume.dtype.itemsize, least)


def in_bytes(count: float) -> str:
    """Return a number of bytes in words: 1.5 GB."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.4g} TB"


def _samples_of(chunks: NDArray[np.bool_], level: Level) -> int:
    """Return how many samples the chunks hold; those at the end of an axis hold fewer."""
    lengths = (
        np.diff(np.minimum(np.arange(count + 1) * length, samples))
        for count, length, samples in zip(chunks.shape, level.source.chunk_shape, level.source.shape, strict=True)
    )
    return int(np.einsum("zyx,z,y,x", chunks.astype(np.int64), *lengths))
