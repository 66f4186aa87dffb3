"""GPU cache of a scene: the textures of its volumes, the shadows between them, its surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from texvol.opengl.contexts import Context
from texvol.opengl.drawing import Drawing, DrawnVolume, View
from texvol.opengl.projection import ValueProjection, projection_of
from texvol.opengl.shadows import Shadow, Shadows
from texvol.opengl.texture_store import Stopwatch
from texvol.rendering.settings import Settings
from texvol.rendering.volume_cache import VolumeCache
from texvol.scene.lighting import Lighting
from texvol.scene.scene import CompleteScene
from texvol.scene.transfer import NO_MEDIUM
from texvol.textures.value_texture import ValueTexture
from texvol.util.errors import NoRoomError

if TYPE_CHECKING:
    from texvol.opengl.surfaces.surfaces import Surfaces


class SceneCache:
    """GPU cache of the scene that was drawn last; its methods need the context to be current.

    The textures of each volume take at most `budget` bytes.
    """

    def __init__(self, context: Context, budget: int, watch: Stopwatch) -> None:
        self._context, self._budget, self.watch = context, budget, watch
        self.volumes = [VolumeCache(context, budget, self.watch)]
        self._shadows = Shadows(context, budget)
        self._surfaces: Surfaces | None = None  # made when a scene first has some

    @property
    def lost_digits(self) -> float:
        """Largest `VolumeCache.lost_digits` of all volumes."""
        return max(cache.lost_digits for cache in self.volumes)

    def rounding(self, scene: CompleteScene) -> float:
        """Sum of `VolumeCache.rounding` of all volumes."""
        return sum(cache.rounding(scene) for cache in self.volumes)

    def drawing(self, scene: CompleteScene, size: tuple[int, int], settings: Settings, depth: bool = False) -> Drawing:
        """Bake what is not there yet, and return what is to be drawn; with `depth` that of the isosurface's depth."""
        scenes = scene.each_alone()
        self._have_caches(len(scenes))
        with self.watch.timed("bake"):
            each_alone = zip(self.volumes, scenes, strict=True)
            scenes = tuple(cache.coarser_scene(alone, scene, settings) for cache, alone in each_alone)
            shadows = self._shadows.prepare(scenes, settings.slab_thickness, settings.shadow_nodes)
            each_with = list(zip(scenes, self.volumes, shadows, strict=True))
            for alone, cache, shadow in each_with:
                light = shadow.transmittance if shadow else None
                cache.prepare(stored_scene(alone), size, settings, light, alone=len(scenes) == 1)
            projection = projection_of(scenes[0], depth=depth)
            if projection and projection.sign_of_largest and settings.skip_empty:
                self.volumes[0].prepare_bounds(projection.sign_of_largest)
        drawn = tuple(_drawn(alone, cache, settings, projection, shadow) for alone, cache, shadow in each_with)
        view = View(scenes[0].camera, size, settings.slab_thickness, scene.volume.centre)
        return Drawing(
            view,
            drawn,
            color_scale=1.0 if projection else color_scale_of(scenes),
            least_transmittance=settings.early_termination / most_light_of(scenes),
            cutting=scene.cutting,
            depth_cue=scenes[0].depth_cue if not projection or projection.lighting else None,
            projection=projection,
            slicing=settings.slicing,
            least_divided=settings.least_divided(scene),
        )

    def surfaces(self, scene: CompleteScene, size: tuple[int, int], settings: Settings) -> Surfaces | None:
        """Return the surfaces and lines of the scene, ready to be drawn; None if it has none."""
        if not scene.geometry and scene.depth is None:
            return None
        if self._surfaces is None:
            from texvol.opengl.surfaces.surfaces import Surfaces

            self._surfaces = Surfaces(self._context.gl, self._budget // 4)
        self._surfaces.prepare(scene, size, settings.slab_thickness)
        return self._surfaces

    def check_room(self, drawing: Drawing) -> None:
        """Raise NoRoomError if several volumes do not fit on the device at once, each as a single brick."""
        if len(drawing.volumes) == 1:
            return
        each = [(drawn.textures.bytes_of_all, len(drawn.textures.bricks) == 1) for drawn in drawing.volumes]
        if lack := lack_of_room(each, self._budget):
            raise NoRoomError(lack)

    def _have_caches(self, count: int) -> None:
        """Keep as many volume caches as the scene has volumes."""
        while len(self.volumes) > count:
            self.volumes.pop().release()
        while len(self.volumes) < count:
            self.volumes.append(VolumeCache(self._context, self._budget, self.watch))

    def release(self) -> None:
        """Release everything on the device."""
        for cache in self.volumes:
            cache.release()
        self._shadows.release()
        if self._surfaces is not None:
            self._surfaces.release()


def lack_of_room(volumes: Sequence[tuple[int, bool]], budget: int) -> str:
    """Return why several volumes have no room on the device together; "" if they have.

    Of each volume it takes the bytes of its texture, and True if the driver makes one of that size.
    """
    total = sum(size for size, _ in volumes)
    if total > budget:
        return (
            f"{len(volumes)} volumes are drawn at once and need {total / 1e6:.0f} MB of textures, got "
            f"{budget / 1e6:.0f} MB: allow more by --texture-memory, or take smaller volumes"
        )
    if too_large := [size for size, is_made in volumes if not is_made]:
        return (
            f"{len(volumes)} volumes are drawn at once, each from one texture, and the driver makes none of "
            f"{max(too_large) / 1e6:.0f} MB: take smaller volumes"
        )
    return ""


def _drawn(
    alone: CompleteScene,
    cache: VolumeCache,
    settings: Settings,
    projection: ValueProjection | None,
    shadow: Shadow | None,
) -> DrawnVolume:
    """Return one volume with its textures."""
    assert cache.baked is not None
    empty_space = cache.empty_space if settings.skips(alone) else None
    skips = empty_space.skips if empty_space else None
    lit_when_drawn = isinstance(cache.baked, ValueTexture) and not projection
    return DrawnVolume(
        alone.volume,
        cache.baked,
        cache.textures,
        empty_space.visible_part if empty_space else lambda brick: brick.stored_box,
        skips,
        cache.empty_space.cells_per_box if skips else (1.0, 1.0, 1.0),
        lighting=projection.lighting if projection else alone.lighting if lit_when_drawn else None,
        light_transmittance=shadow.texture if shadow and lit_when_drawn else None,
        bounds=cache.bounds if projection and projection.sign_of_largest and settings.skip_empty else None,
        fetched=settings.interpolation == "shader",
    )


def stored_scene(scene: CompleteScene) -> CompleteScene:
    """Return the scene whose texels are stored: in every mode but composite they are the values.

    Labels are stored as values and classified when they are sampled, which takes least memory. Samples with colours
    of their own are classified before.
    """
    if scene.mode == "composite":
        if scene.volume.nearest:
            return replace(scene, classification="post")
        if scene.volume.colors is not None and scene.classification in ("post", "integrated"):
            return replace(scene, classification="extinction")
        return scene
    return replace(scene, transfer_function=NO_MEDIUM, classification="post", depth_cue=None)


def color_scale_of(scenes: Sequence[CompleteScene]) -> float:
    """Power of two that scales the colours of a picture to at most about 1, for targets of small range.

    Associated colours are at most 1 in white light of strength 1. An emission of E per world unit adds up to at most E
    times the longest ray; emissions of several volumes add up.
    """
    glowing = sum(scene.medium.emissive for scene in scenes)
    return min(map(_color_scale, scenes)) / 2 ** max(glowing - 1, 0)


def _color_scale(scene: CompleteScene) -> float:
    """Return the factor for the medium of one volume and for surfaces in it."""
    brightest = 1.0 if scene.lighting is None else max(scene.lighting.brightest, 1.0)
    if scene.medium.emissive:
        brightest = float(scene.medium.colors.max()) * 2 * scene.volume.radius
    if scene.geometry:
        brightest = max(brightest, (scene.lighting or Lighting()).brightest, 1.0)
    return float(np.exp2(np.clip(-np.ceil(np.log2(brightest)), -120, 120))) if brightest > 0 else 1.0


def most_light_of(scenes: Sequence[CompleteScene]) -> float:
    """Upper bound of the light from behind a point: of a white medium in all lights, and of emission beyond that."""
    glow = sum(2 * scene.volume.radius * scene.medium.excess_emission for scene in scenes)
    lighting = scenes[0].lighting
    return (1.0 + glow) * max(lighting.brightest if lighting else 1.0, 1.0)
