"""Samples of a large volume in memory, its parts on the device, and the threads that make the ones from the others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from texvol.opengl.contexts import Context
from texvol.opengl.part_store import PartStore
from texvol.opengl.texture_store import Stopwatch, is_software
from texvol.rendering.streaming.ahead import PartsAhead
from texvol.rendering.streaming.sample_cache import SampleCache
from texvol.scene.in_chunks import is_in_chunks
from texvol.scene.large_volume import LargeVolume

_OF_MEMORY = 1 / 4  # for textures, where they are in the machine's memory


class VolumeParts:
    """Samples and parts of one volume; its methods need the context to be current.

    Parameters
    ----------
    memory : int
        Bytes of samples, and of textures where these are in the machine's memory.
    budget : int
        Bytes of textures.
    watch : Stopwatch
        Takes the seconds of baking and uploading.
    """

    def __init__(self, context: Context, volume: LargeVolume, memory: int, budget: int, watch: Stopwatch) -> None:
        self.volume = volume
        software = is_software(context)
        # Samples that are in memory anyway take none of it.
        shared = software and not is_in_chunks(volume)
        self.texture_bytes = min(budget, int(memory * _OF_MEMORY)) if shared else budget
        of_textures = self.texture_bytes if shared else 0
        self.cache = SampleCache(volume, max(memory - of_textures, memory // 2))
        self.parts = PartStore(context, self.texture_bytes, watch)
        self.ahead = PartsAhead(self.cache, self.parts)

    def release(self) -> None:
        """End the threads, release everything on the device, and forget the samples."""
        self.ahead.close()
        self.cache.close()
        self.parts.release()


def reading_of(volumes: Sequence[VolumeParts]) -> dict[str, Any]:
    """Return what is told of the reading of all volumes together, in JSON types for `--stats`."""
    of_each = [each.cache.stats for each in volumes]
    return {name: sum(each[name] for each in of_each) for name in of_each[0]} if of_each else {}
