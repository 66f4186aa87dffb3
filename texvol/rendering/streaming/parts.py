"""Parts of a picture of a large volume: texels and empty space that they have in common or of their own."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context
from texvol.opengl.drawing import Drawing, DrawnVolume, View
from texvol.opengl.empty_space import EmptySpace
from texvol.opengl.part_store import Part, Prepared, shown_part
from texvol.opengl.texture_store import BakedTexture
from texvol.rendering.render import bake, draw_brick, draw_together
from texvol.rendering.scene_cache import color_scale_of, most_light_of, stored_scene
from texvol.rendering.settings import Settings
from texvol.rendering.streaming.ordering import RegionsOfPicture, with_settled_light
from texvol.rendering.streaming.visibility import chunks_that_show
from texvol.rendering.volume_cache import shown_of
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick
from texvol.slicing.cells import cell_side
from texvol.slicing.regions import Region, brick_of
from texvol.textures import texel_format
from texvol.textures.distribution import Smoothed, Spread, spread_of
from texvol.textures.shaded_samples import seen_from
from texvol.textures.spread_texture import bake_spread
from texvol.textures.value_storage import features_of_medium, storage_of
from texvol.textures.value_texture import REFERENCE, ValueTexture

_CELLS_OF_CHUNKS = 3.0  # sides of cells: chunks no longer than so many are cells, which the store's statistics know
_ALL_OF_THE_BOX = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)  # number of cells along x, y, z and where they begin, of one cell
Size = tuple[int, int]


class PictureOfParts(RegionsOfPicture):
    """Drawing of a picture, texels and empty space of its parts."""

    def __init__(
        self, context: Context, scene: CompleteScene, size: Size, settings: Settings, volume: LargeVolume
    ) -> None:
        super().__init__(stored_scene(with_settled_light(scene)), size, settings, volume)
        self._gl = context.gl
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
        # Threads share what is worked out once.
        self.smoothed = Smoothed(scene.medium, volume.smallest_spacing) if self._has_distributions else None

    @cached_property
    def _is_exact(self) -> bool:
        """True if values are stored as they are in every texel format."""
        scene, volume = self.scene, self.volume
        if scene.classification not in ("post", "integrated") or scene.needs_gradient:
            return False
        small = volume.dtype.kind in "iu" and volume.dtype.itemsize <= 2
        return small and storage_of(volume.overview, features_of_medium(scene.medium, volume.overview)).is_well

    @cached_property
    def view(self) -> str:
        """All on which it depends what is opaque before a part; parts of which something is left out are of one."""
        scene, drawing = self.scene, self.drawing
        return (
            f"{scene.camera} {self.size} {scene.cutting} {scene.lighting} {scene.classification} "
            f"{drawing.view.slab_thickness} {drawing.least_transmittance} {self.settings.level_error}"
        )

    def texels(self, brick: Brick) -> tuple[Any, ...]:
        """Return what the texels of a brick are made of."""
        scene = self.scene
        light = (repr(scene.gradient), seen_from(scene)) if scene.needs_gradient else ()
        thickness = self.settings.slab_thickness if scene.classification == "slab" else 0.0
        if brick.level and self._has_distributions:
            kind = "distributions"
        else:
            kind = "values" if self._is_exact else scene.classification
        samples = f"{brick.level} {self.left_to_coarse(brick)}"
        return (self.volume, scene.medium, kind, self.texel_format, thickness, samples, *light)

    def prepared(self, volume: Volume, brick: Brick) -> Prepared:
        """Return what a part's textures are made from; any thread may do that, without the context."""
        scene, spread = replace(self.scene, volume=volume), None
        if brick.level and self._has_distributions:
            assert self.smoothed is not None
            spread = spread_of(self.volume, volume, brick, self.smoothed)
            estimator = scene.gradient if scene.needs_gradient else None
            baked: BakedTexture = bake_spread(volume, scene.medium, spread, estimator)
        else:
            baked = bake(scene, self.settings.slab_thickness, self.texel_format)
        empty_space, shown = self._empty_space(volume, baked, brick, spread)
        self._find_range(volume, brick)
        # Values take little more memory as texels; others are baked slice by slice when they are uploaded.
        is_small = isinstance(baked, ValueTexture) and baked.estimator is None
        texels = baked.all_texels((slice(None),) * 3) if is_small and shown is not None else None
        return Prepared(baked, empty_space, shown, texels)

    def _empty_space(
        self, volume: Volume, baked: BakedTexture, brick: Brick, spread: Spread | None
    ) -> tuple[EmptySpace | None, NDArray[np.float64] | None]:
        """Return the empty space of a part, None if it has none of its own, and the corners of what it shows."""
        scene = replace(self.scene, volume=volume)
        if not self.settings.skips(scene):
            return None, brick.stored_box
        steps = baked.steps if isinstance(baked, ValueTexture) else None
        if self.visible_chunks is not None and brick.level == 0 and steps is None:
            box = self.shown_samples(brick.first, brick.last)
            if box is None:
                return None, None
            (low, high), ends = box / np.array(self.volume.dimensions), brick.stored_box
            return None, np.array([np.maximum(low, ends[0]), np.minimum(high, ends[1])])
        of_samples = float(np.prod(self.volume.levels[brick.level].source.shape, dtype=float))
        empty_space = EmptySpace(self._gl)
        empty_space.prepare(volume, *shown_of(scene), None, steps, of_samples, spread)
        return empty_space, shown_part(empty_space, brick)

    def leaves_gaps(self, level: int) -> bool:
        """True if chunks that do not matter are not sampled, but next to one that does: they are skipped as cells."""
        if level or self.settings.level_error is not None:  # the finest level continues where chunks are left to others
            return False
        return self._is_exact and self.settings.skips(self.scene) and self.visible_chunks is not None

    @property
    def _chunks_per_box(self) -> tuple[float, float, float]:
        statistics = self.volume.levels[0].statistics
        assert statistics is not None
        x, y, z = (n / one for n, one in zip(self.volume.dimensions, statistics.chunk_shape[::-1], strict=True))
        return x, y, z

    def _find_range(self, volume: Volume, brick: Brick) -> None:
        """Have a part know the range of its values, so that the thread that draws does not work it out."""
        # Statistics of a coarse level would be read for this alone.
        statistics = self.volume.levels[0].statistics if brick.level == 0 else None
        if statistics is None or volume.dtype.kind == "f" or "value_range" in vars(volume):
            _ = volume.value_range
            return
        ends = zip(brick.stored_first[::-1], brick.stored_last[::-1], statistics.chunk_shape, strict=True)
        chunks = tuple(slice(a // n, -(-b // n)) for a, b, n in ends)
        volume.remember_range(float(statistics.minimum[chunks].min()), float(statistics.maximum[chunks].max()))

    @cached_property
    def visible_chunks(self) -> NDArray[np.bool_] | None:
        """Chunks of level 0 that may show anything, where they are small enough to take the place of cells."""
        statistics = self.volume.levels[0].statistics
        if statistics is None or self.beyond.any():
            return None
        side = cell_side(float(np.prod(self.volume.dimensions, dtype=float)))
        is_fine = max(statistics.chunk_shape) <= _CELLS_OF_CHUNKS * side
        return chunks_that_show(self.scene, self.volume) if is_fine else None

    @cached_property
    def _space(self) -> EmptySpace | None:
        """The empty space that parts without one of their own have in common."""
        return None if self.visible_chunks is None else EmptySpace.known(self._gl, self.visible_chunks)

    def release(self) -> None:
        """Release what parts have in common."""
        if "_space" in vars(self) and self._space is not None:
            self._space.release()

    @cached_property
    def _has_distributions(self) -> bool:
        """True if samples of coarse levels stand for distributions of values: labels do not, nor do gradients."""
        return not (self.volume.nearest or self.scene.medium.needs_gradient)

    def bytes_of(self, order: list[Region]) -> float:
        """Return about how many bytes of texels all regions have."""
        per_sample = 4 if self.scene.classification in ("post", "integrated") else 16
        level = self.volume.levels[self.settings.level]
        finest = [brick_of(each, level, self.settings.level, self.volume.dimensions, self.margin) for each in order]
        return sum(float(np.prod(brick.texture_size)) for brick in finest) * per_sample

    def draw(self, compositor: Compositor, part: Part) -> None:
        """Composite a part behind the picture so far."""
        space = part.empty_space or (self._space if self.settings.skips(self.scene) else None)
        skips = space.skips if space is not None else None
        cells = _ALL_OF_THE_BOX
        if skips is not None:
            cells = part.cells if part.empty_space is not None else (self._chunks_per_box, _ALL_OF_THE_BOX[1])
        lit_when_drawn = isinstance(part.baked, ValueTexture)
        one = DrawnVolume(
            self.volume,
            part.baked,
            part,
            lambda brick: part.shown,
            skips,
            *cells,
            lighting=self.scene.lighting if lit_when_drawn else None,
            fetched=self.settings.interpolation == "shader",
        )
        drawing = replace(self.drawing, volumes=(one,))
        assert part.shown is not None
        if self.volume.nearest:
            draw_together(compositor, drawing, [part.brick], part.shown)
        else:
            draw_brick(compositor, drawing, part.brick, part.shown)
