"""Stand-ins: the coarse level of a volume in a store that the window holds in memory.

Panels, slices and moving pictures are of the stand-in, which is as quick to turn as any small volume; pictures at rest
and files are of the store.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from texvol.scene.added_volume import AddedVolume

_MOST = 1 << 24  # samples: 256³
_OF_MEMORY = 1 / 8  # that a stand-in takes at most: the window and its painters have one each
_PAINTERS = 2


class StandIn(Volume):
    """A level of a large volume, in memory; `large` is the volume, `level` the number of the level."""

    large: LargeVolume
    level: int

    @property
    def notes(self) -> tuple[str, ...]:
        """Those of the large volume."""
        return self.large.notes

    @notes.setter
    def notes(self, notes: Sequence[str]) -> None:
        """Leave the notes of the part alone."""

    @cached_property
    def value_range(self) -> tuple[float, float] | None:
        """That of the large volume, if its store tells it: pictures at rest and in motion have one window of values."""
        return self._told.value_range

    @cached_property
    def finite_range(self) -> tuple[float, float] | None:
        """As `value_range`."""
        return self._told.finite_range

    @cached_property
    def _told(self) -> Volume:
        """Volume that tells the range of values: the large one, or the part itself."""
        known = None if self.large.levels[0].statistics is None else self.large.value_range
        return self.large if known is not None and np.isfinite(known).all() else Volume(self.values)


def stand_in(volume: Volume) -> Volume:
    """Return what the window shows of a volume: itself, all of its store in memory if that is small, or a stand-in."""
    if not isinstance(volume, LargeVolume):
        return volume
    most = min(_MOST, int(volume.memory * _OF_MEMORY) // volume.dtype.itemsize)
    sizes = [int(np.prod(level.source.shape, dtype=np.int64)) for level in volume.levels]
    if sizes[0] <= most:
        return volume.whole
    fitting = [number for number, size in enumerate(sizes) if size <= most]
    if fitting:
        number = fitting[0]
        made = volume.part(number, (0, 0, 0), volume.at_level(number).dimensions)
    else:
        number, made = len(sizes) - 1, volume.overview
    volume.memory //= _PAINTERS
    made.__class__ = StandIn
    assert isinstance(made, StandIn)
    made.large, made.level = volume, number
    return made


def in_memory(added: AddedVolume) -> AddedVolume:
    """Return an added volume with what the window shows of it."""
    volume = stand_in(added.volume)
    return added if volume is added.volume else replace(added, volume=volume)


def with_stand_ins(scene: Scene) -> Scene:
    """Return the scene whose volumes are all in memory."""
    return _replaced(scene, stand_in)


def at_rest(scene: Scene) -> Scene:
    """Return the scene of the volumes in their stores, if it can be drawn part by part or they fit in memory.

    Else the scene is returned as it is.
    """
    from texvol.rendering.streaming.kinds import fits, needs_memory

    stored = _replaced(scene, lambda volume: volume.large if isinstance(volume, StandIn) else volume)
    return stored if needs_memory(stored) is None or fits(stored) else scene


def _replaced(scene: Scene, by: Callable[[Volume], Volume]) -> Scene:
    volume = by(scene.volume)
    added = tuple(
        each if (other := by(each.volume)) is each.volume else replace(each, volume=other) for each in scene.added
    )
    if volume is scene.volume and all(a is b for a, b in zip(added, scene.added, strict=True)):
        return scene
    return replace(scene, volume=volume, added=added)
