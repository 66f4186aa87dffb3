"""Pictures of a large volume: its regions, front to back, read ahead of drawing, and forgotten when they are drawn.

What is not read: regions off the screen or cut away, chunks in which the store's statistics say that nothing shows, and
regions of which all pixels are opaque already. The picture is the same as of the volume in memory: slabs have one phase
for the whole box, and each is drawn by the region in which its middle lies.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context
from texvol.opengl.drawing import Drawing, DrawnVolume, View
from texvol.opengl.empty_space import EmptySpace
from texvol.opengl.part_store import Part, PartStore
from texvol.opengl.texture_store import BakedTexture, Stopwatch, is_software, same
from texvol.rendering.render import bake, draw_brick, draw_together, read
from texvol.rendering.scene_cache import color_scale_of, most_light_of, stored_scene
from texvol.rendering.settings import Settings
from texvol.rendering.stats import described_alike
from texvol.rendering.streaming.ordering import Drawn, RegionsOfPicture, with_settled_light
from texvol.rendering.streaming.sample_cache import SampleCache
from texvol.rendering.streaming.visibility import AHEAD, Screen, needed_chunks
from texvol.rendering.volume_cache import shown_of
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick
from texvol.slicing.regions import Region, brick_of, regions_of_level
from texvol.textures import texel_format
from texvol.textures.distribution import Smoothed, spread_of
from texvol.textures.shaded_samples import seen_from
from texvol.textures.spread_texture import bake_spread
from texvol.textures.value_storage import HOPELESS, ULP, features_of_medium, storage_of
from texvol.textures.value_texture import REFERENCE, ValueTexture
from texvol.util.statistics import median

_OF_MEMORY = 1 / 4  # for textures, where they are in the machine's memory

Size = tuple[int, int]


@dataclass(frozen=True)
class _Next:
    """A brick that is about to be drawn, and the same of the finest level."""

    finest: Brick
    brick: Brick
    asked: bool  # for its samples


class StreamedPictures:
    """Pictures of one large volume after the other; methods need the context to be current.

    `budget` is the number of bytes for textures, `watch` takes the seconds of baking and uploading.
    """

    def __init__(self, context: Context, compositor: Compositor, budget: int, watch: Stopwatch) -> None:
        self._context, self.compositor, self._watch, self._budget = context, compositor, watch, budget
        self._cache: SampleCache | None = None
        self._parts: PartStore | None = None
        self.drawn, self.bricks_drawn, self.lost_digits = Drawn(), 0, 0.0
        self._formats: set[str] = set()
        self._known_levels: tuple[tuple[Any, ...], dict[Region, int]] | None = None
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

        Of a block the regions are drawn whose middles lie in it.
        """
        times = []
        for _ in range(max(repeat, 1)):
            start, spent = time.perf_counter(), self._watch.of_textures()
            drawing = self._drawn(scene, size, settings, block)
            times.append(time.perf_counter() - start - (self._watch.of_textures() - spent))
        self._watch.seconds["draw"] = median(times[1:] or times)
        with self._watch.timed("read"):
            return read(self.compositor, drawing)

    def count(
        self, scene: CompleteScene, size: Size, settings: Settings, block: NDArray[np.float64] | None = None
    ) -> int:
        """Return the number of slabs that are sampled, in all or in a block."""
        self._drawn(scene, size, replace(settings, target_format="rgba32f"), block, count=True)
        return int(self.compositor.picture()[..., 0].sum(dtype=np.float64))

    def rounding(self, scene: CompleteScene) -> float:
        """Upper bound of the last picture's error by the rounding of values."""
        return min(self.lost_digits, 1.0) if self.lost_digits >= HOPELESS * ULP else 0.0

    @contextmanager
    def set_aside(self, most_bytes: int | None) -> Iterator[None]:
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
            "texture_bytes": self._parts.bytes if self._parts else 0,
            "parts": self.stats,
        }

    def _drawn(
        self,
        scene: CompleteScene,
        size: Size,
        settings: Settings,
        block: NDArray[np.float64] | None,
        count: bool = False,
    ) -> Drawing:
        volume = scene.volume
        assert isinstance(volume, LargeVolume)
        cache, parts = self._prepared(volume)
        picture = _Picture(scene, size, settings, volume)
        picture.levels = self._levels_of(picture)
        picture.drawing = drawing = replace(picture.drawing, count=count)
        self._formats, self.lost_digits = set(), 0.0
        compositor = self.compositor
        compositor.begin(drawing, settings.target_format)
        regions = regions_of_level(volume, settings.level)
        order, self.drawn = picture.in_order(regions)
        order = [region for region in order if block is None or region.is_in(block, volume.dimensions)]
        numbers = range(len(volume.levels))
        cache.need([needed_chunks(picture.scene, volume, number, picture.beyond) for number in numbers])
        screen = Screen(picture.scene, size, drawing.least_transmittance, settings.level_error is not None)
        with cache.counted():
            self._draw_all(order, screen, cache, parts, picture)
        self.drawn.hidden, self.bricks_drawn = screen.hidden, self.drawn.drawn
        compositor.finish()
        return drawing

    def _levels_of(self, picture: RegionsOfPicture) -> dict[Region, int]:
        """Return the levels that were chosen for the same view by the same error, so that pictures can be compared."""
        scene = picture.scene
        view = (scene.volume, scene.medium, scene.lighting, f"{scene.camera} {scene.cutting} {scene.classification}")
        if (error := picture.settings.level_error) is None:
            return {}
        if self._known_levels is None or not same(self._known_levels[0], (*view, error)):
            self._known_levels = (*view, error), {}
        return self._known_levels[1]

    def _draw_all(
        self, order: list[Region], screen: Screen, cache: SampleCache, parts: PartStore, picture: _Picture
    ) -> None:
        everything = picture.bytes_of(order) <= self._budget_of(picture.volume)
        for next_one in self._read_ahead(order, screen, cache, parts, picture):
            brick = next_one.brick
            part = parts.known(brick, picture.texels(brick.level), picture.scene.classification)
            if part is None:
                part = self._baked(brick, next_one.asked, cache, parts, picture, everything)
            self._note(part)
            if part.shown is not None:
                picture.draw(self.compositor, part)
                screen.has_drawn(self.compositor, brick, part.baked.volume.value_range)
            self.tell(self.drawn.drawn / max(len(order) - screen.hidden, 1))

    def _note(self, part: Part) -> None:
        self.drawn.drawn += 1
        level = part.brick.level
        self.drawn.by_level[level] = self.drawn.by_level.get(level, 0) + 1
        self._formats.add(part.baked.texel_format)
        if isinstance(part.baked, ValueTexture):
            self.lost_digits = max(self.lost_digits, part.baked.storage.condition * ULP)

    @property
    def stats(self) -> dict[str, Any]:
        """Report of the last picture in JSON types for `--stats`."""
        if self._cache is None or self._parts is None:
            return {}
        drawn = self.drawn
        regions = {"regions": drawn.regions, "regions_drawn": drawn.drawn, "regions_hidden": drawn.hidden}
        levels = {str(level): count for level, count in sorted(drawn.by_level.items())}
        return {**regions, "regions_empty": drawn.empty, "levels": levels, **self._cache.stats}

    def release(self) -> None:
        """Release everything on the device, and the samples."""
        if self._cache is not None:
            self._cache.close()
        if self._parts is not None:
            self._parts.release()
        self._cache = self._parts = None

    def _prepared(self, volume: LargeVolume) -> tuple[SampleCache, PartStore]:
        """Return the samples and the textures of a volume; those of another one are forgotten."""
        if self._cache is None or self._parts is None or self._cache.volume is not volume:
            self.release()
            textures = self._budget_of(volume)
            of_textures = textures if is_software(self._context) else 0
            self._cache = SampleCache(volume, max(volume.memory - of_textures, volume.memory // 2))
            self._parts = PartStore(self._context, textures, self._watch)
        return self._cache, self._parts

    def _budget_of(self, volume: LargeVolume) -> int:
        """Bytes for textures: a software driver's are in the machine's memory."""
        return min(self._budget, int(volume.memory * _OF_MEMORY)) if is_software(self._context) else self._budget

    def _read_ahead(
        self, order: list[Region], screen: Screen, cache: SampleCache, parts: PartStore, picture: _Picture
    ) -> Iterator[_Next]:
        """Yield the bricks that are to be drawn, in order; the next ones are read meanwhile."""
        waiting, ahead = deque(enumerate(order)), deque[_Next]()
        while waiting or ahead:
            while waiting and len(ahead) < AHEAD:
                number, region = waiting[0]
                finest = picture.brick(region, 0)
                if screen.hides(finest):
                    waiting.popleft()
                    continue
                if ahead and screen.may_hide(finest, [each.finest for each in ahead]):
                    break  # read only once it is known to be seen
                brick = picture.brick(region, picture.level(region, partial(screen.seen, finest, number)))
                known = parts.known(brick, picture.texels(brick.level), picture.scene.classification) is not None
                asked = not known and cache.ask(brick.level, brick.stored_first, brick.stored_last)
                if not (known or asked) and ahead:
                    break
                ahead.append(_Next(finest, brick, asked))
                waiting.popleft()
            if ahead:
                yield ahead.popleft()
            screen.has_come_to(waiting[0][0] - len(ahead) if waiting else len(order))

    def _baked(
        self, brick: Brick, asked: bool, cache: SampleCache, parts: PartStore, picture: _Picture, everything: bool
    ) -> Part:
        volume = cache.part(brick.level, brick.stored_first, brick.stored_last, asked)
        with self._watch.timed("bake"):
            baked, find_empty = picture.baked(volume, brick)
        return parts.added(brick, picture.texels(brick.level), baked, find_empty, everything)


class _Picture(RegionsOfPicture):
    """State on the device that all regions of a picture have in common."""

    def __init__(self, scene: CompleteScene, size: Size, settings: Settings, volume: LargeVolume) -> None:
        super().__init__(stored_scene(with_settled_light(scene)), size, settings, volume)
        scene = self.scene
        thickness = settings.slab_thickness
        self.drawing = Drawing(
            View(scene.camera, size, thickness, volume.centre),
            (),
            color_scale=color_scale_of((scene,)),
            least_transmittance=settings.early_termination / most_light_of((scene,)),
            cutting=scene.cutting,
            depth_cue=scene.depth_cue,
            slicing=settings.slicing,
        )
        self.texel_format = settings.texture_format
        if self.texel_format == "auto":
            self.texel_format = texel_format.cheapest_texel_format(
                volume.overview, scene.medium, scene.classification, thickness
            )
        if scene.needs_gradient and scene.classification in ("post", "integrated"):
            self.texel_format = "rgba32f"  # whose gradients need no scale that all parts have in common
        if self._is_exact:
            self.texel_format = "exact"
        if self.texel_format == REFERENCE and scene.classification in ("slab", "extinction"):
            self.texel_format = "rgba32f"

    @cached_property
    def _is_exact(self) -> bool:
        """True if values are stored as they are in every texel format."""
        scene, volume = self.scene, self.volume
        if scene.classification not in ("post", "integrated") or scene.needs_gradient:
            return False
        small = volume.dtype.kind in "iu" and volume.dtype.itemsize <= 2
        return small and storage_of(volume.overview, features_of_medium(scene.medium, volume.overview)).is_well

    def texels(self, level: int) -> tuple[Any, ...]:
        """Return what the texels of a level are made of."""
        scene = self.scene
        light = (repr(scene.gradient), seen_from(scene)) if scene.needs_gradient else ()
        thickness = self.settings.slab_thickness if scene.classification == "slab" else 0.0
        if level and self._has_distributions:
            kind = "distributions"
        else:
            kind = "values" if self._is_exact else scene.classification
        return (self.volume, scene.medium, kind, self.texel_format, thickness, f"{level}", *light)

    def baked(self, volume: Volume, brick: Brick) -> tuple[BakedTexture, Any]:
        """Return the texture of a part, and what prepares its empty space."""
        scene, spread = replace(self.scene, volume=volume), None
        if brick.level and self._has_distributions:
            spread = spread_of(self.volume, volume, brick, self.smoothed)
            estimator = scene.gradient if scene.needs_gradient else None
            baked: BakedTexture = bake_spread(volume, scene.medium, spread, estimator)
        else:
            baked = bake(scene, self.settings.slab_thickness, self.texel_format)
        of_samples = float(np.prod(self.volume.levels[brick.level].source.shape, dtype=float))

        def find_empty(empty_space: EmptySpace) -> None:
            steps = baked.steps if isinstance(baked, ValueTexture) else None
            empty_space.prepare(volume, *shown_of(scene), None, steps, of_samples, spread)

        return baked, find_empty if self.settings.skips(scene) else None

    @property
    def _has_distributions(self) -> bool:
        """True if samples of coarse levels stand for distributions of values: labels do not, nor do gradients."""
        return not (self.volume.nearest or self.scene.medium.needs_gradient)

    @cached_property
    def smoothed(self) -> Smoothed:
        """The transfer function, smoothed for coarse levels."""
        return Smoothed(self.scene.medium, self.volume.smallest_spacing)

    def bytes_of(self, order: list[Region]) -> float:
        """Return about how many bytes of texels all regions have."""
        per_sample = 4 if self.scene.classification in ("post", "integrated") else 16
        level = self.volume.levels[self.settings.level]
        finest = [brick_of(each, level, self.settings.level, self.volume.dimensions, self.margin) for each in order]
        return sum(float(np.prod(brick.texture_size)) for brick in finest) * per_sample

    def draw(self, compositor: Compositor, part: Part) -> None:
        """Composite a part behind the picture so far."""
        cells: tuple[Any, Any] = part.cells if part.skips is not None else ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
        lit_when_drawn = isinstance(part.baked, ValueTexture)
        one = DrawnVolume(
            self.volume,
            part.baked,
            part,
            lambda brick: part.shown,
            part.skips,
            *cells,
            lighting=self.scene.lighting if lit_when_drawn else None,
        )
        drawing = replace(self.drawing, volumes=(one,))
        assert part.shown is not None
        if self.volume.nearest:
            draw_together(compositor, drawing, [part.brick], part.shown)
        else:
            draw_brick(compositor, drawing, part.brick, part.shown)
