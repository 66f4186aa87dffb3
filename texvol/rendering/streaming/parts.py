"""Parts of a picture of a large volume: texels and empty space that they have in common or of their own."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context
from texvol.opengl.drawing import AnyTexture, Drawing, DrawnVolume, View
from texvol.opengl.empty_space import EmptySpace
from texvol.opengl.part_store import Part, Prepared, shown_part
from texvol.opengl.projection import SURFACE_ENDING, projection_of
from texvol.opengl.texture_store import BakedTexture
from texvol.opengl.value_bounds import Bounds
from texvol.rendering.render import bake, draw_brick, draw_together
from texvol.rendering.scene_cache import color_scale_of, most_light_of, stored_scene
from texvol.rendering.settings import Settings
from texvol.rendering.streaming.ordering import RegionsOfPicture, with_settled_light
from texvol.rendering.streaming.visibility import chunks_that_show
from texvol.rendering.volume_cache import shown_of
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import NUMBER_MODES, CompleteScene
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
        self,
        context: Context,
        scene: CompleteScene,
        size: Size,
        settings: Settings,
        volume: LargeVolume,
        depth: bool = False,
        alone: bool = True,
    ) -> None:
        scene = replace(scene, lighting=None) if scene.mode in NUMBER_MODES else with_settled_light(scene)
        self.projection = projection_of(scene, depth=depth)
        cue = scene.depth_cue if self.projection is None or self.projection.lighting is not None else None
        super().__init__(stored_scene(scene), size, settings, volume, alone)
        self._gl = context.gl
        scene = self.scene
        is_composite = self.projection is None
        self.drawing = Drawing(
            View(scene.camera, size, settings.slab_thickness, volume.centre),
            (),
            color_scale=color_scale_of((scene,)) if is_composite else 1.0,
            least_transmittance=self._least_transmittance,
            cutting=scene.cutting,
            depth_cue=cue,
            projection=self.projection,
            slicing=settings.slicing,
        )
        self.texel_format = self._texel_format_of()
        # Threads share what is worked out once.
        adds_up = self.projection is not None and self.projection.measures_rays and volume.dtype.kind == "f"
        self._range = volume.value_range if adds_up else None
        self.smoothed = Smoothed(scene.medium, volume.smallest_spacing) if self._has_distributions else None

    @property
    def _least_transmittance(self) -> float:
        """Transmittance at which a ray ends: 0 in modes whose parts do not hide each other."""
        scene = self.scene
        if scene.mode in NUMBER_MODES:
            return 0.0
        ending = self.settings.early_termination
        if scene.mode == "isosurface":
            ending = max(ending, SURFACE_ENDING)
        return ending / most_light_of((scene,))

    def _texel_format_of(self) -> str:
        """Return the texel format of all parts, as `bake` takes it."""
        scene, asked = self.scene, self.settings.texture_format
        if scene.mode == "isosurface":
            return asked if asked == REFERENCE else "rgba32f"  # as below
        if self.is_exact or (self.projection is not None and asked != REFERENCE):
            return "exact"
        if scene.needs_gradient and scene.classification in ("post", "integrated"):
            return "rgba32f"  # whose gradients need no scale that all parts have in common
        if asked == "auto":
            how = scene.medium, scene.classification, self.settings.slab_thickness
            return texel_format.cheapest_texel_format(self.volume.overview, *how)
        return "rgba32f" if asked == REFERENCE and scene.classification in ("slab", "extinction") else asked

    @cached_property
    def is_exact(self) -> bool:
        """True if values are stored as they are in every texel format."""
        scene, volume = self.scene, self.volume
        if scene.classification not in ("post", "integrated") or scene.needs_gradient or self.projection is not None:
            return False
        small = volume.dtype.kind in "iu" and volume.dtype.itemsize <= 2
        return small and storage_of(volume.overview, features_of_medium(scene.medium, volume.overview)).is_well

    @cached_property
    def view(self) -> str:
        """All on which it depends what is opaque before a part; parts of which something is left out are of one."""
        scene, drawing = self.scene, self.drawing
        settings = self.settings
        mode: str = scene.mode
        if self.projection is not None:
            mode += f" {scene.isovalues} {self.projection.looks[:, 3].tolist()} {self.projection.depth}"
        return (
            f"{scene.camera} {self.size} {scene.cutting} {scene.lighting} {scene.classification} {mode} "
            f"{drawing.view.slab_thickness} {drawing.least_transmittance} {settings.level_error} {settings.level} "
            f"{settings.coarser_by_pixels}"
        )

    def texels(self, brick: Brick) -> tuple[Any, ...]:
        """Return what the texels of a brick are made of."""
        scene = self.scene
        light = (repr(scene.gradient), seen_from(scene)) if scene.needs_gradient else ()
        thickness = self.settings.slab_thickness if scene.classification == "slab" else 0.0
        if brick.level and self._has_distributions:
            kind = "distributions"
        else:
            kind = "values" if self.is_exact else scene.classification
            kind = kind if self.projection is None else f"numbers {self._sign_of_bounds} {scene.isovalues}"
        samples = f"{brick.level} {self.left_to_coarse(brick)}"
        return (self.volume, scene.medium, kind, self.texel_format, thickness, samples, *light)

    def prepared(self, volume: Volume, brick: Brick) -> Prepared:
        """Return what a part's textures are made from; any thread may do that, without the context."""
        scene, spread = replace(self.scene, volume=volume), None
        if self.projection is not None:
            self._find_range(volume, brick)  # on which it depends how values are stored
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
        bounds = None
        if self._sign_of_bounds:
            assert isinstance(baked, ValueTexture), "only values are projected"
            bounds = Bounds.of(baked, self._sign_of_bounds, brick.stored_first)
        return Prepared(baked, empty_space, shown, texels, bounds)

    @property
    def _sign_of_bounds(self) -> float:
        """Sign with which values in cells are compared, of which rays skip some; 0 where they skip none."""
        return self.projection.sign_of_largest if self.projection and self.settings.skip_empty else 0.0

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
        return self.is_exact and self.settings.skips(self.scene) and self.visible_chunks is not None

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
            _ = volume.finite_range, volume.has_missing
            if self._range is not None and volume.value_range is not None and not np.isfinite(self._range).all():
                # Where any part has infinities all are integrated from plane to plane, as the volume in memory is.
                (low, high), (lowest, highest) = volume.value_range, self._range
                volume.remember_range(min(low, lowest), max(high, highest))
            return
        ends = zip(brick.stored_first[::-1], brick.stored_last[::-1], statistics.chunk_shape, strict=True)
        chunks = tuple(slice(a // n, -(-b // n)) for a, b, n in ends)
        volume.remember_range(float(statistics.minimum[chunks].min()), float(statistics.maximum[chunks].max()))

    @cached_property
    def visible_chunks(self) -> NDArray[np.bool_] | None:
        """Chunks of level 0 that may show anything, where they are small enough to take the place of cells."""
        statistics = self.volume.levels[0].statistics
        if statistics is None or self.sees_between:
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
        is_composite = self.projection is None
        return is_composite and not (self.volume.nearest or self.scene.medium.needs_gradient)

    def bytes_of(self, order: list[Region]) -> float:
        """Return about how many bytes of texels all regions have."""
        is_small = self.scene.classification in ("post", "integrated") and self.scene.mode != "isosurface"
        per_sample = 4 if is_small else 16
        level = self.volume.levels[self.settings.level]
        margin = self.margin_of(self.settings.level)
        finest = [brick_of(each, level, self.settings.level, self.volume.dimensions, margin) for each in order]
        return sum(float(np.prod(brick.texture_size)) for brick in finest) * per_sample

    def drawn_volume(self, part: Part) -> DrawnVolume:
        """Return a part as what is drawn of the volume."""
        space = part.empty_space or (self._space if self.settings.skips(self.scene) else None)
        skips = space.skips if space is not None else None
        cells = _ALL_OF_THE_BOX
        if skips is not None:
            cells = part.cells if part.empty_space is not None else (self._chunks_per_box, _ALL_OF_THE_BOX[1])
        lighting = self.scene.lighting if isinstance(part.baked, ValueTexture) and self.projection is None else None
        if self.projection is not None and not self.drawing.count:  # light changes no count
            lighting = self.projection.lighting
        return DrawnVolume(
            self.volume,
            part.baked,
            part,
            lambda brick: part.shown,
            skips,
            *cells,
            lighting=lighting,
            bounds=part.bounds,
            fetched=self.settings.interpolation == "shader",
        )

    def draw(self, compositor: Compositor, part: Part, known: dict[str, AnyTexture] | None = None) -> None:
        """Composite a part behind the picture so far; or draw its numbers, of which some may be `known`."""
        self.draw_by(replace(self.drawing, known=known or {}), compositor, part)

    def draw_by(self, drawing: Drawing, compositor: Compositor, part: Part) -> None:
        """Composite a part, that shows something, by a drawing of the same scene."""
        drawing = replace(drawing, volumes=(self.drawn_volume(part),))
        assert part.shown is not None
        if self.volume.nearest:
            draw_together(compositor, drawing, [part.brick], part.shown)
        else:
            draw_brick(compositor, drawing, part.brick, part.shown)
