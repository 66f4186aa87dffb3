"""What a picture is made by: its settings, and of what its texels are made, so that what is the same is kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from texvol.opengl.projection import NO_MEDIUM, Isovalue
from texvol.rendering import accuracy
from texvol.scene.camera import Camera
from texvol.scene.lighting import Lighting, casts_shadows
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.slicing.cells import Shown
from texvol.textures.shaded_samples import seen_from


@dataclass(frozen=True)
class Settings:
    """How a scene is drawn: what `Renderer.render` was asked for, with every choice made."""

    slab_thickness: float  # world units
    texture_format: str
    target_format: str
    early_termination: float
    skip_empty: bool

    def skips(self, scene: Scene) -> bool:
        """Whether cells are leapt over: all of them are looked at where the values themselves are seen."""
        return self.skip_empty and scene.mode in ("composite", "isosurface")


def stored_scene(scene: Scene) -> Scene:
    """The scene whose texels are wanted: of any mode but composite these are the values, whatever their matter.

    Labels are looked up where they are sampled, which is the same before as after, and takes least room. Samples that
    have a colour of their own are classified first.
    """
    if scene.mode == "composite":
        if scene.volume.labels:
            return replace(scene, classification="post")
        if scene.volume.colors is not None and scene.classification in ("post", "integrated"):
            return replace(scene, classification="extinction")
        return scene
    return replace(scene, transfer_function=NO_MEDIUM, classification="post", depth_cue=None)


def shown_of(scene: Scene, transfer_function: TransferFunction) -> tuple[Shown, int]:
    """What of a scene shows anything, and the reach of the gradients that it depends on; 0 where it depends on none."""
    if scene.isovalue is not None:
        return Isovalue(scene.isovalue), 0
    return transfer_function, scene.gradient.reach if transfer_function.needs_gradient else 0


def color_scale_of(medium: Sequence[tuple[Scene, TransferFunction]]) -> float:
    """What colours are multiplied with while a picture is drawn, of each volume's matter and of surfaces."""
    scales = []
    for scene, transfer_function in medium:
        brightest = max((scene.lighting or Lighting()).brightest, 1.0) if scene.geometry else 0.0
        scales.append(accuracy.color_scale(scene.volume, transfer_function, scene.lighting, brightest))
    # What glows adds up, beyond the brightest of all.
    glowing = sum(transfer_function.emissive for _, transfer_function in medium)
    return min(scales) / 2 ** max(glowing - 1, 0)


def most_light_of(medium: Sequence[tuple[Scene, TransferFunction]]) -> float:
    """The most light that may come from behind something: of white matter in all lights, and of what glows beyond."""
    glow = sum(2 * scene.volume.radius * transfer_function.excess_emission for scene, transfer_function in medium)
    lighting = medium[0][0].lighting
    return (1.0 + glow) * max(lighting.brightest if lighting else 1.0, 1.0)


def texels_of(
    scene: Scene, transfer_function: TransferFunction, camera: Camera, thickness: float, texture_format: str
) -> tuple[Any, ...]:
    """Cache key of a scene's texels, without the storage of values."""
    gradient = (repr(scene.gradient),) if scene.needs_gradient else ()
    if scene.classification in ("slab", "extinction"):
        # Shadows are cast through parts of the slabs' thickness.
        baked_for = thickness if scene.classification == "slab" or casts_shadows(scene.lighting) else 0.0
        medium = (scene.volume, scene.mask, transfer_function, scene.classification, baked_for, texture_format)
        return (*medium, *gradient, seen_from(scene, camera)) if gradient else medium
    return (scene.volume, scene.mask, *gradient)
