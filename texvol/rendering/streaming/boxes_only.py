"""Boxes of volumes that show nothing where others do: pieces of rays end where these boxes do all the same.

So the picture does not depend on what is known to be empty.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from texvol.opengl.contexts import Context
from texvol.opengl.drawing import DrawnVolume
from texvol.opengl.texture_store import Stopwatch
from texvol.rendering.settings import Settings
from texvol.rendering.volume_cache import VolumeCache
from texvol.scene.scene import CompleteScene
from texvol.scene.transfer import NO_MEDIUM
from texvol.scene.volume import Volume

_ROOM = 1 << 16  # bytes of a texture of one sample, and more


class BoxesOnly:
    """Maker of boxes without matter; methods need the context to be current."""

    def __init__(self, context: Context, watch: Stopwatch) -> None:
        self._nothing = Volume(np.zeros((1, 1, 1), np.uint8), name="nothing")
        self._cache = VolumeCache(context, _ROOM, watch)

    def drawn_volume(self, scene: CompleteScene, size: tuple[int, int], settings: Settings) -> DrawnVolume:
        """Return the box of the volume of a scene."""
        unlit = replace(scene, lighting=None, depth_cue=None)
        nothing = replace(unlit, volume=self._nothing, transfer_function=NO_MEDIUM, classification="extinction")
        self._cache.prepare(nothing, size, settings, None, alone=False)
        assert self._cache.baked is not None
        skips = self._cache.empty_space.skips if settings.skips(nothing) else None
        textures = self._cache.textures
        return DrawnVolume(scene.volume, self._cache.baked, textures, lambda brick: brick.stored_box, skips)

    def release(self) -> None:
        """Release everything on the device."""
        self._cache.release()
