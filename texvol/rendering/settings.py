"""Render settings and texture cache keys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from texvol.opengl.projection import Isovalue
from texvol.scene.lighting import Lighting, casts_shadows
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.transfer import NO_MEDIUM
from texvol.slicing.cells import Shown
from texvol.textures.shaded_samples import seen_from


@dataclass(frozen=True)
class Settings:
    """Arguments of `Renderer.render` with every choice made."""

    slab_thickness: float  # world units
    texture_format: str
    target_format: str
    early_termination: float
    skip_empty: bool

    def skips(self, scene: Scene) -> bool:
        """True if empty cells are skipped; in pictures of numbers every cell counts."""
        return self.skip_empty and scene.mode in ("composite", "isosurface")


def stored_scene(scene: CompleteScene) -> CompleteScene:
    """Return the scene whose texels are stored: in every mode but composite they are the values.

    Labels are stored as values and classified when they are sampled, which takes least memory. Samples with colours
    of their own are classified before.
    """
    if scene.mode == "composite":
        if scene.volume.labels:
            return replace(scene, classification="post")
        if scene.volume.colors is not None and scene.classification in ("post", "integrated"):
            return replace(scene, classification="extinction")
        return scene
    return replace(scene, transfer_function=NO_MEDIUM, classification="post", depth_cue=None)


def shown_of(scene: CompleteScene) -> tuple[Shown, int]:
    """Return what shows anything, and the reach in samples of the gradients that it depends on, 0 for none."""
    if scene.isovalue is not None:
        return Isovalue(scene.isovalue), 0
    return scene.medium, scene.gradient.reach if scene.medium.needs_gradient else 0


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


def texels_of(scene: CompleteScene, thickness: float, texture_format: str) -> tuple[Any, ...]:
    """Cache key of a scene's texels, without the storage of values."""
    gradient = (repr(scene.gradient),) if scene.needs_gradient else ()
    if scene.classification in ("slab", "extinction"):
        # Shadows are cast through parts of the slabs' thickness.
        baked_for = thickness if scene.classification == "slab" or casts_shadows(scene.lighting) else 0.0
        medium = (scene.volume, scene.mask, scene.medium, scene.classification, baked_for, texture_format)
        return (*medium, *gradient, seen_from(scene)) if gradient else medium
    return (scene.volume, scene.mask, *gradient)
