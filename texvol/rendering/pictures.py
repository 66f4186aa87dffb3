"""Pictures of scenes whose volumes are in memory: drawn, counted and described, with their textures kept in a cache."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context
from texvol.opengl.texture_store import Stopwatch
from texvol.rendering import forecast
from texvol.rendering.render import draw, read
from texvol.rendering.scene_cache import SceneCache
from texvol.rendering.settings import Settings
from texvol.rendering.stats import described
from texvol.scene.scene import CompleteScene
from texvol.textures.value_texture import Rounded
from texvol.util import progress
from texvol.util.statistics import median

Size = tuple[int, int]
Corners = NDArray[np.float64]


class Pictures(Protocol):
    """Maker of pictures; its methods need the context to be current."""

    bricks_drawn: int  # of the last picture

    def draw(
        self,
        scene: CompleteScene,
        size: Size,
        settings: Settings,
        repeat: int = 1,
        depth: bool = False,
        block: Corners | None = None,
    ) -> NDArray[np.float32]:
        """Return the picture, without background; or the depth of its isosurface.

        `block` is the low and high corner of the part that is drawn, in fractions of the first volume's box, shape
        (2, 3): pictures of blocks that fill the box, composited in order of visibility, are the whole one.
        """

    def count(self, scene: CompleteScene, size: Size, settings: Settings, block: Corners | None = None) -> int:
        """Return the number of slabs that are sampled, in all or in a block."""

    def rounding(self, scene: CompleteScene) -> float:
        """Upper bound of the last picture's error by the rounding of values."""

    @property
    def hidden_rounding(self) -> Rounded:
        """Part of the texels whose rounding may make two pictures of them wrong alike."""

    @property
    def lost_digits(self) -> float:
        """Rounding of values, as a fraction of the narrowest interval of a transfer function."""

    def described(self, scene: CompleteScene, size: Size, settings: Settings) -> dict[str, Any]:
        """Return the entries of `--stats` that say what was drawn."""

    def set_aside(self, most_bytes: int | None, exact_gradients: bool = True) -> Any:
        """Keep the last picture's textures while other pictures are drawn inside the context."""

    def release(self) -> None:
        """Release everything on the device."""


class PicturesInMemory:
    """Pictures of volumes in memory, whose textures take at most `budget` bytes each."""

    def __init__(self, context: Context, compositor: Compositor, budget: int, watch: Stopwatch) -> None:
        self._context, self.compositor, self._watch = context, compositor, watch
        self.cache = SceneCache(context, budget, watch)
        self.bricks_drawn = 0

    def draw(
        self,
        scene: CompleteScene,
        size: Size,
        settings: Settings,
        repeat: int = 1,
        depth: bool = False,
        block: Corners | None = None,
    ) -> NDArray[np.float32]:
        """Return the picture, without background, or that of a block; or the depth of its isosurface."""
        drawing = replace(self.cache.drawing(scene, size, settings, depth), block=block)
        surfaces = None if depth else self.cache.surfaces(scene, size, settings)
        self.cache.check_room(drawing)
        for drawn in drawing.volumes:
            if len(drawn.textures.bricks) == 1 and drawn.visible_part(drawn.textures.bricks[0]) is not None:
                drawn.textures.resources(drawn.textures.bricks[0])
        times = []
        bricks = sum(len(drawn.textures.bricks) for drawn in drawing.volumes) if len(drawing.volumes) == 1 else 1
        for _ in range(max(repeat, 1)):
            start, spent = time.perf_counter(), self._watch.of_textures()
            part = progress.part(lambda: forecast.of_drawing(scene, size, settings), bricks)
            with part, self.compositor.within(settings.regions):
                self.bricks_drawn = draw(self.compositor, drawing, surfaces, settings.target_format)
            times.append(time.perf_counter() - start - (self._watch.of_textures() - spent))
        # The first draw compiles the programs: warm draws are the others.
        self._watch.seconds["draw"] = median(times[1:] or times)
        with self._watch.timed("read"):
            return read(self.compositor, drawing)

    def count(self, scene: CompleteScene, size: Size, settings: Settings, block: Corners | None = None) -> int:
        """Return the number of slabs that are sampled, in all or in a block."""
        drawing = self.cache.drawing(scene, size, settings)
        # Light changes no opacity, and so no count.
        unlit = tuple(replace(drawn, lighting=None, light_transmittance=None) for drawn in drawing.volumes)
        drawing = replace(drawing, volumes=unlit, depth_cue=None, count=True, block=block)
        with self.compositor.within(settings.regions):
            draw(self.compositor, drawing, self.cache.surfaces(scene, size, settings), "rgba32f")
        return int(self.compositor.picture()[..., 0].sum(dtype=np.float64))

    def rounding(self, scene: CompleteScene) -> float:
        """Upper bound of the last picture's error by the rounding of values."""
        return self.cache.rounding(scene)

    @property
    def hidden_rounding(self) -> Rounded:
        """Part of the texels whose rounding may make two pictures of them wrong alike."""
        found = {each.hidden_rounding for each in self.cache.volumes}
        return "values" if "values" in found else "gradients" if "gradients" in found else "nothing"

    @property
    def lost_digits(self) -> float:
        """Rounding of values, as a fraction of the narrowest interval of a transfer function."""
        return self.cache.lost_digits

    def described(self, scene: CompleteScene, size: Size, settings: Settings) -> dict[str, Any]:
        """Return the entries of `--stats` that say what was drawn."""
        return described(self._context, self.cache, scene, size, settings)

    @contextmanager
    def set_aside(self, most_bytes: int | None, exact_gradients: bool = True) -> Iterator[None]:
        """Keep the last picture's textures, see `VolumeCache.set_aside`."""
        with ExitStack() as aside:
            for medium in self.cache.volumes:
                aside.enter_context(medium.set_aside(most_bytes, exact_gradients))
            yield

    def release(self) -> None:
        """Release everything on the device."""
        self.cache.release()
