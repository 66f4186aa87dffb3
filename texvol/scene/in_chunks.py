"""Volumes that are drawn part by part although their samples fit in memory, or are there."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from weakref import WeakKeyDictionary, WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import Box, LargeVolume, Level, Triple
from texvol.scene.volume import Volume

_CHUNK = 64  # samples along an axis
# By the identity of a volume, which lives as long as the large one does, and the memory for its parts.
_KNOWN: WeakValueDictionary[tuple[int, int | None], LargeVolume] = WeakValueDictionary()
_STORES: WeakKeyDictionary[LargeVolume, LargeVolume] = WeakKeyDictionary()


def in_parts(volume: Volume) -> LargeVolume:
    """Return a volume as a large one that is drawn part by part, the same object while that is in use."""
    if not isinstance(volume, LargeVolume):
        return in_chunks(volume, None)
    if volume not in _STORES:
        made = _STORES[volume] = copy(volume)
        made.in_parts = True
        vars(made).pop("whole", None)  # its parts are read from the store
    return _STORES[volume]


def is_in_chunks(volume: LargeVolume) -> bool:
    """True if it was made by `in_chunks` of a volume in memory."""
    return isinstance(volume.levels[0].source, _InMemory)


def in_chunks(volume: Volume, memory: int | None) -> LargeVolume:
    """Return a volume as one whose parts are drawn, for `memory` bytes of them; a large one as it is.

    Without `memory` it is half of what is free. Colours of samples and masks do not come along. The samples are those
    of the volume, which must not change. The same volume is returned as the same object while that is in use.
    """
    if isinstance(volume, LargeVolume):
        return volume
    if (known := _KNOWN.get((id(volume), memory))) is not None:
        return known
    large = LargeVolume(
        [Level(_InMemory(volume.values))],
        volume.spacing,
        volume.origin,
        volume.direction,
        memory=memory,
        unit=volume.unit,
        value_unit=volume.value_unit,
        space=volume.space,
        name=volume.name,
        source=volume.source,
        notes=volume.notes,
        labels=volume.labels,
        blocks=volume.blocks,
        channel=volume.channel,
        channels=volume.channels,
    )
    large.label_table = volume.label_table
    large.in_parts = True
    vars(large).update(whole=volume, overview=volume)  # nothing has to be read for them
    _KNOWN[id(volume), memory] = large
    return large


@dataclass(frozen=True)
class _InMemory:
    """Samples of an array, in chunks."""

    array: NDArray
    bytes_read: int = 0

    @property
    def shape(self) -> Triple:
        nz, ny, nx = self.array.shape
        return nz, ny, nx

    @property
    def dtype(self) -> np.dtype:
        return self.array.dtype

    @property
    def chunk_shape(self) -> Triple:
        z, y, x = (min(n, _CHUNK) for n in self.array.shape)
        return z, y, x

    def read(self, box: Box) -> NDArray:
        return self.array[box]
