"""GPU cache of one volume: its textures and its empty cells, kept between pictures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from texvol.opengl.contexts import Context
from texvol.opengl.empty_space import EmptySpace
from texvol.opengl.projection import Isovalue
from texvol.opengl.texture_store import BakedTexture, Stopwatch, TextureStore, same
from texvol.opengl.value_bounds import ValueBounds
from texvol.rendering.render import bake
from texvol.rendering.settings import Settings
from texvol.scene.air import attenuation_of
from texvol.scene.display import NUMBER_MODES
from texvol.scene.lighting import casts_shadows
from texvol.scene.scene import CompleteScene
from texvol.scene.volume import Volume
from texvol.slicing import bricks
from texvol.slicing.cells import Shown
from texvol.textures import halving as coarser
from texvol.textures import texel_format
from texvol.textures.shaded_samples import LightTransmittance, seen_from
from texvol.textures.value_storage import FAR, HOPELESS, ULP
from texvol.textures.value_texture import REFERENCE, Rounded, ValueTexture

_OF_A_CUBIC = 3.0  # an extreme of a cubic, in roundings of the four values that determine it
Recipe = tuple[Any, ...]


class VolumeCache:
    """GPU cache of one volume of a scene, at most `budget` bytes of textures; methods need the context to be current.

    `watch` takes the seconds in which textures are made and uploaded.
    """

    def __init__(self, context: Context, budget: int, watch: Stopwatch) -> None:
        self._context, self._budget, self._watch = context, budget, watch
        self.empty_space, self.bounds = EmptySpace(context.gl), ValueBounds(context.gl)
        self.textures = TextureStore(context, budget, watch)
        self.baked: BakedTexture | None = None
        self._recipe: Recipe = ()
        self._chosen: tuple[Recipe, str] | None = None
        self._source: Volume | None = None  # the full volume if a halved one is drawn
        self._coarsest: tuple[Recipe, dict[float, Volume]] | None = None  # by slab thickness

    def coarser_scene(self, alone: CompleteScene, scene: CompleteScene, settings: Settings) -> CompleteScene:
        """Return the scene of one volume; of a scene's only volume a halved one where slabs are thick enough for it."""
        self._source = None
        if self._coarsest is not None and self._coarsest[0][0] is not scene.volume:
            self._coarsest = None  # nothing is kept of a volume that is gone
        if scene.added or settings.texture_format != "auto":
            return alone
        medium, thickness = scene.medium, settings.slab_thickness
        if not coarser.may_be_coarser(scene, thickness):
            return scene
        if self._coarsest is None or not same(self._coarsest[0], (scene.volume, medium)):
            self._coarsest = (scene.volume, medium), {}
        known = self._coarsest[1]
        if thickness not in known:
            known[thickness] = coarser.coarsest(scene.volume, medium, thickness)
        if known[thickness] is scene.volume:
            return scene
        self._source = scene.volume
        return replace(scene, volume=known[thickness])

    def prepare(
        self,
        scene: CompleteScene,
        size: tuple[int, int],
        settings: Settings,
        light_transmittance: LightTransmittance | None,
        alone: bool,
    ) -> None:
        """Bake the texels of a scene of one volume and find its empty cells, unless they are there.

        `light_transmittance` is that from the nodes of the box to each light that casts shadows. `alone` is True if no
        other volume is drawn with it.
        """
        thickness, texture_format = settings.slab_thickness, settings.texture_format
        if texture_format == "auto":
            asked = (scene.volume, scene.medium, scene.classification, thickness)
            if self._chosen is None or not same(self._chosen[0], asked):
                self._chosen = asked, texel_format.cheapest_texel_format(*asked)
            texture_format = self._chosen[1]
        if texture_format == REFERENCE and scene.classification in ("slab", "extinction"):
            texture_format = "rgba32f"
        texels = _texels(scene, settings, texture_format)
        whole = settings.slicing == "wilson"
        recipe = (*texels, scene.medium, scene.classification, texture_format, scene.mode, f"{scene.isovalues}", whole)
        if self.baked is None or not same(self._recipe, recipe):
            self.baked, self._recipe = bake(scene, thickness, texture_format, light_transmittance, whole), recipe
        baked = self.baked
        if isinstance(baked, ValueTexture):
            texels = (*texels, baked.texel_format, baked.storage.offset, baked.storage.scale)
        else:
            texels = (*texels, baked.length_unit)
        if settings.skips(scene):
            steps = baked.steps if isinstance(baked, ValueTexture) else None
            self.empty_space.prepare(scene.volume, *shown_of(scene), scene.mask, steps)
        margin = bricks.margin(scene.volume, scene.camera, size, thickness)
        self.textures.prepare(baked, scene.volume, texels, margin, alone)

    def prepare_bounds(self, sign: float) -> None:
        """Find the bounds of the values times `sign`, unless they are there, of a volume that is prepared."""
        assert isinstance(self.baked, ValueTexture), "only values are projected"
        self.bounds.prepare(self.baked, sign)

    def halvings(self, volume: Volume) -> list[int]:
        """Numbers of halvings of the volume along x, y, z before it was drawn."""
        return coarser.halvings(volume, self.baked.volume) if self.baked else [0, 0, 0]

    @contextmanager
    def set_aside(self, most_bytes: int | None, exact_gradients: bool = True) -> Iterator[None]:
        """Keep the last picture's textures while other pictures are drawn inside the context.

        Textures of exact values serve every thickness, with their gradients unless these must be exact. Other texels
        are drawn from temporary textures, in bricks of at least an eighth of the volume within `most_bytes`, if that is
        given.
        """
        if self.baked is None or (self._source is None and _has_exact_values(self.baked, exact_gradients)):
            yield
            return
        kept, budget = (self.textures, self.baked, self._recipe, self.empty_space, self._source), self._budget
        if most_bytes is not None:
            samples = (self._source or self.baked.volume).size
            budget = min(budget, int(np.clip(2 * samples, most_bytes // 8, most_bytes)))
        self.textures = TextureStore(self._context, budget, self._watch)
        if self._source is not None:
            self.empty_space = EmptySpace(self._context.gl)
        try:
            yield
        finally:
            self.textures.release()
            if self.empty_space is not kept[3]:
                self.empty_space.release()
            self.textures, self.baked, self._recipe, self.empty_space, self._source = kept

    @property
    def lost_digits(self) -> float:
        """Rounding of values, as a fraction of the narrowest interval of the transfer function."""
        return self.baked.storage.condition * ULP if isinstance(self.baked, ValueTexture) else 0.0

    def rounding(self, scene: CompleteScene) -> float:
        """Upper bound of the error of a picture by the rounding of values.

        It is 0 if a picture of values with other rounding estimates that error better.
        """
        return rounding_of_values(self.baked, scene) if isinstance(self.baked, ValueTexture) else 0.0

    @property
    def hidden_rounding(self) -> Rounded:
        """Part of the texels whose rounding may make two pictures of them wrong alike."""
        baked = self.baked
        is_halved = self._source is not None
        if is_halved or not isinstance(baked, ValueTexture) or not baked.storage.vouches_for_itself(baked.volume):
            return "values"
        return "gradients" if baked.estimator is not None and baked.texel_format == "rgba16" else "nothing"

    def release(self) -> None:
        """Release everything on the device."""
        self.textures.release()
        self.empty_space.release()
        self.bounds.release()
        self._coarsest = None


def rounding_of_values(baked: ValueTexture, scene: CompleteScene) -> float:
    """Return `VolumeCache.rounding` of a picture of values in a texture."""
    storage = baked.storage
    if not (storage.vouches_for_itself(baked.volume) or storage.condition >= HOPELESS):
        return 0.0
    if scene.mode not in NUMBER_MODES:
        return min(storage.condition * ULP, 1.0)
    of_a_value = storage.extent * storage.scale * ULP
    if scene.mode in ("mip", "minip"):
        return _OF_A_CUBIC * min(storage.farthest(baked.volume), FAR * storage.extent) * storage.scale * ULP
    attenuation = attenuation_of(scene.air)
    of_a_value *= 1.0 if attenuation is None else attenuation.per_value
    return of_a_value * (2 * scene.volume.radius if scene.mode == "xray" else 1.0)


def shown_of(scene: CompleteScene) -> tuple[Shown, int]:
    """Return what shows anything, and the reach in samples of the gradients that it depends on, 0 for none."""
    if scene.isovalues:
        return Isovalue(scene.isovalues), 0
    return scene.medium, scene.gradient.reach if scene.medium.needs_gradient else 0


def _texels(scene: CompleteScene, settings: Settings, texture_format: str) -> tuple[Any, ...]:
    """Cache key of a scene's texels, without the storage of values."""
    gradient = (repr(scene.gradient),) if scene.needs_gradient else ()
    if scene.classification in ("slab", "extinction"):
        # Shadows are cast through parts of the slabs' thickness.
        in_shadow = casts_shadows(scene.lighting)
        baked_for = settings.slab_thickness if scene.classification == "slab" or in_shadow else 0.0
        nodes = settings.shadow_nodes if in_shadow else 0
        medium = (scene.volume, scene.mask, scene.medium, scene.classification, baked_for, nodes, texture_format)
        return (*medium, *gradient, seen_from(scene)) if gradient else medium
    return (scene.volume, scene.mask, *gradient)


def _has_exact_values(baked: BakedTexture, exact_gradients: bool) -> bool:
    if not isinstance(baked, ValueTexture):
        return False
    vouches = baked.storage.vouches_for_itself(baked.volume)
    return baked.volume.nearest or (not (baked.estimator and exact_gradients) and baked.steps is None and vouches)
