"""A volume in memory as a large one: parts of its samples are drawn beside those of volumes that stay in a store."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import Box, LargeVolume, Level, Triple
from texvol.scene.volume import Volume

_CHUNK = 16  # samples along an axis


def in_chunks(volume: Volume, memory: int) -> LargeVolume:
    """Return a volume as one whose parts are drawn, for `memory` bytes of them; a large one as it is.

    Colours of samples and masks do not come along. The samples are those of the volume, which must not change.
    """
    if isinstance(volume, LargeVolume):
        return volume
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
    vars(large).update(whole=volume, overview=volume)  # nothing has to be read for them
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
