"""Pictures of a large volume: its regions, front to back, read ahead of drawing, and forgotten when they are drawn.

What is not read: regions off the screen or cut away, chunks in which the store's statistics say that nothing shows, and
regions of which all pixels are opaque already. The picture is the same as of the volume in memory: slabs have one phase
for the whole box, and each is drawn by the region in which its middle lies.

In the modes xray, average, mip and minip each region is drawn by itself, and the numbers of all are collected, in any
order. What cannot change a picture of mip or minip is not read, see `extremes`. Isosurfaces are composited front to
back: each region draws the surfaces in its own slabs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.collected import CollectedNumbers, KnownLargest
from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context
from texvol.opengl.drawing import Drawing
from texvol.opengl.part_store import Part
from texvol.opengl.texture_store import Stopwatch, same
from texvol.rendering.settings import Settings
from texvol.rendering.stats import described_alike
from texvol.rendering.streaming.extremes import KnownExtremes
from texvol.rendering.streaming.ordering import Drawn, KnownLevels
from texvol.rendering.streaming.parts import PictureOfParts
from texvol.rendering.streaming.side_pictures import SidePictures, tells_error
from texvol.rendering.streaming.visibility import Hiding, Screen
from texvol.rendering.streaming.volume_parts import VolumeParts, reading_of
from texvol.rendering.volume_cache import rounding_of_values
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import NUMBER_MODES, CompleteScene
from texvol.slicing.coverage import pixels_of
from texvol.slicing.regions import Region, regions_of_level
from texvol.textures.spread_texture import SpreadTexture
from texvol.textures.value_storage import HOPELESS, ULP
from texvol.textures.value_texture import Rounded, ValueTexture
from texvol.util.statistics import median

Size = tuple[int, int]


class StreamedPictures:
    """Pictures of one large volume after the other; methods need the context to be current.

    `budget` is the number of bytes for textures, `watch` takes the seconds of baking and uploading.
    """

    def __init__(self, context: Context, compositor: Compositor, budget: int, watch: Stopwatch) -> None:
        self._context, self.compositor, self._watch, self._budget = context, compositor, watch, budget
        self._of_volumes: list[VolumeParts] = []
        self.drawn, self.bricks_drawn, self.lost_digits = Drawn(), 0, 0.0
        self._rounding, self._vouches = 0.0, False  # of the numbers of a projection
        self._collected: CollectedNumbers | None = None  # of the last picture, if it is one of numbers
        self._known = KnownLargest(context.gl)
        self._formats: set[str] = set()
        self._known_levels: tuple[tuple[Any, ...], KnownLevels] | None = None
        self.draws_estimates = False  # True: small pictures tell the error of the next one, if that is worth it
        self.estimated: float | None = None  # error of the last of these
        self._side: SidePictures | None = None
        self.tell: Callable[[float], None] = lambda fraction: None  # is told which fraction of a picture is drawn

    def draw(
        self,
        scene: CompleteScene,
        size: Size,
        settings: Settings,
        repeat: int = 1,
        depth: bool = False,
        block: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float32]:
        """Return the picture without background, shape (height, width, 4), of a scene of one LargeVolume.

        Of a block the regions are drawn whose middles lie in it. With `depth` it is that of the isosurface.
        """
        times = []
        for _ in range(max(repeat, 1)):
            start, spent = time.perf_counter(), self._watch.of_textures()
            drawing = self._drawn(scene, size, settings, block, depth=depth)
            times.append(time.perf_counter() - start - (self._watch.of_textures() - spent))
        self._watch.seconds["draw"] = median(times[1:] or times)
        with self._watch.timed("read"):
            if self._collected is not None:
                return self._collected.picture(settings.slab_thickness)
            return self.compositor.picture(drawing.color_scale)

    def count(
        self, scene: CompleteScene, size: Size, settings: Settings, block: NDArray[np.float64] | None = None
    ) -> int:
        """Return the number of slabs that are sampled, in all or in a block."""
        self._drawn(scene, size, replace(settings, target_format="rgba32f"), block, count=True)
        return int(self.compositor.picture()[..., 0].sum(dtype=np.float64))

    def rounding(self, scene: CompleteScene) -> float:
        """Upper bound of the last picture's error by the rounding of values."""
        if scene.mode != "composite":
            return self._rounding
        return min(self.lost_digits, 1.0) if self.lost_digits >= HOPELESS * ULP else 0.0

    @property
    def hidden_rounding(self) -> Rounded:
        """Part of the texels whose rounding may make two pictures of them wrong alike."""
        return "nothing" if self._vouches else "values"

    @contextmanager
    def set_aside(self, most_bytes: int | None, exact_gradients: bool = True) -> Iterator[None]:
        """Do nothing: parts of other texels take the place of parts as room is needed."""
        drawn, bricks_drawn = self.drawn, self.bricks_drawn
        yield
        self.drawn, self.bricks_drawn = drawn, bricks_drawn

    def described(self, scene: CompleteScene, size: Size, settings: Settings) -> dict[str, Any]:
        """Return the entries of `--stats` that say what was drawn."""
        return described_alike(self._context, scene, size, settings) | {
            "texture_format": ", ".join(sorted(self._formats)),
            "halvings": [0, 0, 0],
            "bricks_total": self.drawn.regions,
            "texture_bytes": sum(each.parts.bytes for each in self._of_volumes),
            "parts": self.stats,
        }

    def _drawn(
        self,
        scene: CompleteScene,
        size: Size,
        settings: Settings,
        block: NDArray[np.float64] | None,
        count: bool = False,
        depth: bool = False,
    ) -> Drawing:
        volume = scene.volume
        assert isinstance(volume, LargeVolume)
        (parts,) = self._prepared([volume], volume.memory)
        cache = parts.cache
        picture = PictureOfParts(self._context, scene, size, settings, volume, depth)
        picture.levels = self._levels_of(picture)
        picture.drawing = drawing = replace(picture.drawing, count=count)
        self._formats, self.lost_digits, self._rounding = set(), 0.0, 0.0
        self._vouches = drawing.projection is not None or picture.is_exact
        adds_up = drawing.projection is not None and scene.mode in NUMBER_MODES
        self._collected = CollectedNumbers(drawing.projection, size) if adds_up and drawing.projection else None
        compositor = self.compositor
        compositor.begin(drawing, settings.target_format)
        regions = regions_of_level(volume, settings.level)
        order, self.drawn = picture.in_order(regions)
        order = [region for region in order if block is None or region.is_in(block, volume.dimensions)]
        drawn = {picture.level(each) for each in order}
        cache.need([picture.needed(number) if number in drawn else None for number in range(len(volume.levels))])
        bricks = [picture.brick(each, picture.level(each)) for each in order]
        cache.expect([(brick.level, brick.stored_first, brick.stored_last) for brick in bricks])
        screen = self._screen_of(picture)
        try:
            with cache.counted(), self._estimating(picture, order if block is None else []):
                self._draw_all(order, screen, parts, picture)
        except BaseException:
            cache.forget()  # so that what could not be read is tried again
            raise
        finally:
            picture.release()
        self.drawn.hidden, self.bricks_drawn = screen.hidden, self.drawn.drawn
        compositor.finish()
        return drawing

    @contextmanager
    def _estimating(self, picture: PictureOfParts, order: list[Region]) -> Iterator[None]:
        """Draw small pictures along if they are wanted and worth it, and estimate the error from them."""
        if not (self.draws_estimates and tells_error(picture, picture.bytes_of(order))):
            yield
            return
        self._side = SidePictures(self.compositor, picture)
        try:
            yield
            self.estimated = self._side.error()
            self.draws_estimates = False  # what is drawn again is drawn for its time
        finally:
            self._side.release()
            self._side = None

    def _screen_of(self, picture: PictureOfParts) -> Hiding:
        """Return what knows, while a picture is drawn, what would not change it."""
        if picture.value_bounds is None:
            return Screen(picture.scene, picture.size, picture.drawing.least_transmittance)
        assert self._collected is not None
        return KnownExtremes(picture.scene, picture.size, picture.value_bounds, picture.bounds, self._collected)

    def _levels_of(self, picture: PictureOfParts) -> KnownLevels:
        """Return the levels that were chosen for the same view by the same error, so that pictures can be compared."""
        scene = picture.scene
        view = (scene.volume, scene.medium, scene.lighting, f"{scene.camera} {scene.cutting}")
        if (error := picture.settings.level_error) is None:
            return KnownLevels()
        if self._known_levels is None or not same(self._known_levels[0], (*view, error)):
            self._known_levels = (*view, error), KnownLevels()
        return self._known_levels[1]

    def _draw_all(self, order: list[Region], screen: Hiding, parts: VolumeParts, picture: PictureOfParts) -> None:
        everything, ahead = picture.bytes_of(order) <= parts.texture_bytes, parts.ahead
        with closing(ahead.in_order(order, screen, picture)) as pending_parts:
            for pending in pending_parts:
                with self._watch.timed_textures():
                    part = ahead.part(pending, screen, picture, everything)
                self._note(part, picture.scene)
                if part.shown is not None:
                    self._draw(part, picture)
                    screen.has_drawn(self.compositor, pending.brick, part.baked.volume.value_range)
                self.tell(self.drawn.drawn / max(len(order) - screen.hidden, 1))

    def _draw(self, part: Part, picture: PictureOfParts) -> None:
        """Composite a part behind the picture so far; or draw it by itself and collect its numbers."""
        if self._collected is None:
            picture.draw(self.compositor, part)
            if self._side is not None:
                self._side.draw(part)
            return
        assert part.shown is not None and isinstance(part.baked, ValueTexture)
        where, mask = pixels_of(picture.volume, picture.scene.camera, picture.size, part.shown)
        if not mask.size:
            return
        known = None
        if part.bounds is not None:
            known = self._known.samplers(picture.size, where, self._collected.stored_largest(where, part.baked))
        self.compositor.begin(picture.drawing, picture.settings.target_format)
        picture.draw(self.compositor, part, known)
        self._collected.add(where, self.compositor.pixels(*where), part.baked)

    def _note(self, part: Part, scene: CompleteScene) -> None:
        self.drawn.drawn += 1
        level = part.brick.level
        self.drawn.by_level[level] = self.drawn.by_level.get(level, 0) + 1
        self._formats.add(part.baked.texel_format)
        if isinstance(part.baked, ValueTexture):
            self.lost_digits = max(self.lost_digits, part.baked.storage.condition * ULP)
            if scene.mode != "composite":
                self._rounding = max(self._rounding, rounding_of_values(part.baked, scene))
                self._vouches &= part.baked.storage.vouches_for_itself(part.baked.volume)
        if isinstance(part.baked, SpreadTexture):  # its deviations are rounded
            self._vouches = False

    @property
    def stats(self) -> dict[str, Any]:
        """Report of the last picture in JSON types for `--stats`."""
        if not self._of_volumes:
            return {}
        drawn = self.drawn
        regions = {"regions": drawn.regions, "regions_drawn": drawn.drawn, "regions_hidden": drawn.hidden}
        levels = {str(level): count for level, count in sorted(drawn.by_level.items())}
        predicted = {} if drawn.moved is None else {"level_error": drawn.moved}
        return {**regions, "regions_empty": drawn.empty, "levels": levels, **predicted, **reading_of(self._of_volumes)}

    def release(self) -> None:
        """Release everything on the device, and the samples."""
        self._forget_volumes()
        self._known.release()

    def _forget_volumes(self) -> None:
        for each in self._of_volumes:
            each.release()
        self._of_volumes.clear()

    def _prepared(self, volumes: list[LargeVolume], memory: int) -> list[VolumeParts]:
        """Return samples and parts of volumes, for so many bytes each; those of others are forgotten."""
        known = [each.volume for each in self._of_volumes]
        if len(known) != len(volumes) or any(a is not b for a, b in zip(known, volumes, strict=True)):
            self._forget_volumes()
            how = memory, self._budget // len(volumes), self._watch
            self._of_volumes += [VolumeParts(self._context, volume, *how) for volume in volumes]
        return self._of_volumes
