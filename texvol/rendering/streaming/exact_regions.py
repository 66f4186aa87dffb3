"""Regions of the oracle's picture: the scene of each, whose volumes hold the samples in it and around it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from texvol.rendering.streaming.kinds import large_volumes
from texvol.rendering.streaming.sample_cache import SampleCache
from texvol.rendering.streaming.visibility import needed_chunks, regions_that_show
from texvol.scene.added_volume import AddedVolume
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene
from texvol.scene.volume import Volume
from texvol.slicing import bricks
from texvol.slicing.bricks import Triple, whole
from texvol.slicing.common_regions import common_regions, share_of
from texvol.slicing.regions import Region, brick_of, most_samples_of, regions_of

_REGION = 1 << 21  # samples
_NONE = np.zeros(3)
_OF_CACHE = 1 / 2  # of memory


class RegionsOfOracle(Protocol):
    """Regions that may show anything, in the samples of a frame, and the scene of each."""

    frame: LargeVolume
    order: list[Region]  # front to back

    def scene_of(self, region: Region) -> CompleteScene:
        """Return the scene of the samples in a region and around it."""

    def close(self) -> None:
        """Forget all samples."""


def regions_of_oracle(scene: CompleteScene, size: tuple[int, int]) -> RegionsOfOracle:
    """Return the regions of a scene, all of whose volumes are large ones."""
    return _OfSeveral(scene, size) if scene.added else _OfOne(scene, size)


class _Parts:
    """Parts of one volume of a scene, which is read for so many bytes."""

    def __init__(self, scene: CompleteScene, memory: int) -> None:
        volume = scene.volume
        assert isinstance(volume, LargeVolume)
        self.scene, self.volume = scene, volume
        self.margin = np.full(3, 1.0 + (scene.gradient.reach if scene.needs_gradient else 0))
        self._cache = SampleCache(volume, int(memory * _OF_CACHE))
        self._cache.need([needed_chunks(scene, volume, level, _NONE) for level in range(len(volume.levels))])

    def shown(self, size: tuple[int, int], regions: list[Region]) -> list[Region]:
        """Return the regions that may show anything of the volume."""
        return regions_that_show(self.scene, size, self.volume, regions, self.margin, _NONE)

    def part(self, region: Region) -> Volume:
        """Return the samples in a region and around it."""
        brick = brick_of(region, self.volume.levels[0], 0, self.volume.dimensions, self.margin)
        return self._cache.part(0, brick.stored_first, brick.stored_last)

    def close(self) -> None:
        """Forget all samples."""
        self._cache.close()


class _OfOne:
    """Regions of the only volume."""

    def __init__(self, scene: CompleteScene, size: tuple[int, int]) -> None:
        volume = scene.volume
        assert isinstance(volume, LargeVolume)
        self.frame, self._scene, self._parts = volume, scene, _Parts(scene, volume.memory)
        regions = regions_of(volume.dimensions, min(_REGION, most_samples_of(volume)))
        self.order = _in_order(self._parts.shown(size, regions), volume, scene)

    def scene_of(self, region: Region) -> CompleteScene:
        """Return the scene of the samples in a region and around it."""
        return replace(self._scene, volume=self._parts.part(region))

    def close(self) -> None:
        """Forget all samples."""
        self._parts.close()


class _OfSeveral:
    """Regions that several volumes have in common."""

    def __init__(self, scene: CompleteScene, size: tuple[int, int]) -> None:
        volumes = large_volumes(scene)
        self._scene = scene
        self._parts = [_Parts(alone, share_of(volumes)) for alone in scene.each_alone()]
        margins = [parts.margin for parts in self._parts]
        common = common_regions(volumes, [0] * len(volumes), margins, _REGION)
        self.frame = common.frame
        self._own: list[dict[Triple, Region]] = []
        for parts, own in zip(self._parts, common.own, strict=True):
            self._own.append({region.position: region for region in parts.shown(size, list(own.values()))})
        shown = set().union(*self._own)
        self.order = _in_order([each for each in common.regions if each.position in shown], self.frame, scene)

    def scene_of(self, region: Region) -> CompleteScene:
        """Return the scene of the samples in a region and around it."""
        found = [
            (parts, self._settled(parts, own[region.position]))
            for parts, own in zip(self._parts, self._own, strict=True)
            if region.position in own
        ]
        (first, volume), *others = found
        added = tuple(AddedVolume(part, parts.scene.transfer_function) for parts, part in others)
        return replace(first.scene, classification=self._scene.classification, volume=volume, added=added)

    def close(self) -> None:
        """Forget all samples."""
        for parts in self._parts:
            parts.close()

    def _settled(self, parts: _Parts, region: Region) -> Volume:
        """Return a part of a volume whose range is that of all samples: light fades by it."""
        part = parts.part(region)
        vars(part)["finite_range"] = parts.volume.finite_range
        return part


def _in_order(regions: Sequence[Region], frame: LargeVolume, scene: CompleteScene) -> list[Region]:
    """Return regions front to back."""
    at = {region.position: region for region in regions}
    of_frame = [replace(whole(frame), position=each.position, first=each.first, last=each.last) for each in regions]
    return [at[brick.position] for brick in bricks.visibility_order(of_frame, frame, scene.camera)]
