"""Maker of pictures of any scene: of volumes in memory, or of some in stores, part by part."""

from __future__ import annotations

from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context
from texvol.opengl.texture_store import Stopwatch
from texvol.rendering.pictures import Pictures, PicturesInMemory
from texvol.rendering.streaming.picture import StreamedPictures
from texvol.rendering.streaming.several import PicturesOfSeveral
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import Scene


class AnyPictures:
    """Makers of all kinds of pictures on one context, which has to be current.

    `budget` is the number of bytes for textures, `watch` takes the seconds of baking and uploading.
    """

    def __init__(self, context: Context, compositor: Compositor, budget: int, watch: Stopwatch) -> None:
        self._of_memory = context, budget, watch
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

    def forget_volumes_in_memory(self) -> None:
        """Release the textures of volumes in memory, and what they were made from."""
        context, budget, watch = self._of_memory
        self.in_memory.release()
        self.in_memory = PicturesInMemory(context, self.in_memory.compositor, budget, watch)

    def release(self) -> None:
        """Release everything on the device."""
        self.in_memory.release()
        self.in_parts.release()
        self.of_several.release()
