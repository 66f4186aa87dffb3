"""Maker of pictures of any scene: of volumes in memory, or of some in stores, part by part."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context
from texvol.opengl.texture_store import BYTES, Stopwatch, largest_texture
from texvol.rendering.pictures import Pictures, PicturesInMemory
from texvol.rendering.scene_cache import lack_of_room
from texvol.rendering.streaming.picture import StreamedPictures
from texvol.rendering.streaming.several import PicturesOfSeveral
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

_How = ParamSpec("_How")


class AnyPictures:
    """Makers of all kinds of pictures on one context, which has to be current.

    `budget` is the number of bytes for textures, `watch` takes the seconds of baking and uploading.
    """

    def __init__(self, context: Context, compositor: Compositor, budget: int, watch: Stopwatch) -> None:
        self._of_memory = context, budget, watch
        self._without_room: tuple[Volume, ...] = ()
        self._lack = ""
        self.in_memory = PicturesInMemory(context, compositor, budget, watch)
        self.in_parts = StreamedPictures(context, compositor, budget, watch)
        self.of_several = PicturesOfSeveral(context, compositor, budget, watch)

    def of(self, scene: Scene) -> Pictures:
        """Return what draws a scene."""
        return self.streamed(scene) if isinstance(scene.volume, LargeVolume) else self.in_memory

    def streamed(self, scene: Scene) -> StreamedPictures:
        """Return what draws a scene of large volumes, part by part."""
        return self.of_several if scene.added else self.in_parts

    def draw_by(self, compositor: Compositor) -> None:
        """Draw what follows by another compositor on the same context."""
        self.in_memory.compositor = self.in_parts.compositor = self.of_several.compositor = compositor

    def with_estimate(
        self, draw: Callable[_How, NDArray[np.float32]], *args: _How.args, **how: _How.kwargs
    ) -> tuple[NDArray[np.float32], float | None]:
        """Draw a picture, and estimate its error meanwhile if all parts would be read again for it; None if not."""
        self.in_parts.draws_estimates, self.in_parts.estimated = True, None
        try:
            return draw(*args, **how), self.in_parts.estimated
        finally:
            self.in_parts.draws_estimates = False

    def lack_of_room(self, scene: Scene) -> str:
        """Return why the textures of a scene's volumes have no room together, if that is known before they are made."""
        known, volumes = self._without_room, scene.volumes
        if len(known) == len(volumes) and all(a is b for a, b in zip(known, volumes, strict=True)):
            return self._lack
        context, budget, _ = self._of_memory
        each = [volume.size * _least_bytes(scene, volume) for volume in volumes]
        return lack_of_room([(size, size <= largest_texture(context)) for size in each], budget)

    def without_room(self, scene: Scene, lack: str) -> None:
        """Remember that a scene's volumes have no room together, and why, and forget their textures."""
        self._without_room, self._lack = scene.volumes, lack
        context, budget, watch = self._of_memory
        self.in_memory.release()
        self.in_memory = PicturesInMemory(context, self.in_memory.compositor, budget, watch)

    def release(self) -> None:
        """Release everything on the device."""
        self.in_memory.release()
        self.in_parts.release()
        self.of_several.release()


def _least_bytes(scene: Scene, volume: Volume) -> int:
    """Return the bytes that each sample of a volume takes on the device at least."""
    baked = scene.classification in ("slab", "extinction")
    return BYTES["rgba8"] if baked else BYTES["rgba16"] if scene.needs_gradient and not volume.labels else 1
