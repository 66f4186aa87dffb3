"""Scenes that can be drawn part by part; of others all samples have to be in memory at once.

In modes composite and isosurface parts are composited front to back, of several volumes those that lie in a region
together; in the modes whose pictures are numbers (xray, average, mip, minip) each is drawn by itself, and the numbers
are added, or the largest or least is kept.
"""

from __future__ import annotations

from dataclasses import replace

from texvol.scene.in_chunks import in_chunks
from texvol.scene.large_volume import LargeVolume
from texvol.scene.lighting import casts_shadows
from texvol.scene.scene import Scene
from texvol.util.errors import check_type


def drawable(
    scene: Scene, size: tuple[int, int], texture_refinement: int | str | None = None, level: int | str = "auto"
) -> Scene:
    """Return `in_parts_or_memory` of a scene, with its look, that a picture of the size can show.

    Raises
    ------
    InputError
        If it is not a scene, the picture cannot show it, or a volume does not fit in memory.
    """
    check_type("scene", scene, Scene)
    scene.check_for(size)
    return in_parts_or_memory(scene.looked, texture_refinement, level)


def in_parts_or_memory(scene: Scene, texture_refinement: int | str | None = None, level: int | str = "auto") -> Scene:
    """Return the scene if it can be drawn as its volumes are, or else with all of them in memory or all in parts.

    Raises
    ------
    InputError
        If a volume does not fit in memory; the message says what needs it there.
    """
    if not any(isinstance(volume, LargeVolume) for volume in scene.volumes):
        return scene
    reason = reason_for_memory(scene, texture_refinement, level)
    if reason is not None:
        return scene.in_memory(reason)
    return all_in_parts(scene) if scene.added else scene


def reason_for_memory(
    scene: Scene, texture_refinement: int | str | None = None, level: int | str = "auto"
) -> str | None:
    """Return what of a scene is drawn from all samples in memory; None if it is drawn part by part.

    Pictures of modes other than composite, and of several volumes, are drawn so only where the samples do not fit: in
    memory they take less time, and parts are of the level that pixels show, whose means have other extremes and
    surfaces. A coarse `level` that is asked for is drawn part by part.
    """
    is_to_fit = level in ("auto", 0) and not any(volume.in_parts for volume in large_volumes(scene))
    if is_to_fit and (scene.mode != "composite" or scene.added) and fits(scene):
        return "several volumes" if scene.mode == "composite" else f"mode {scene.mode}"
    return needs_memory(scene, texture_refinement)


def needs_memory(scene: Scene, texture_refinement: int | str | None = None) -> str | None:
    """Return what of a scene cannot be drawn part by part; None if all of it can."""
    reasons = {
        "a mask": any(mask is not None for mask in (scene.mask, *(each.mask for each in scene.added))),
        "colours of samples": any(volume.colors is not None for volume in scene.volumes),
        "meshes or lines": bool(scene.geometry),
        "a depth picture": scene.depth is not None,
        "shadows": scene.mode == "composite" and casts_shadows(scene.lighting),
        "the adaptive gradient": scene.needs_gradient and scene.gradient.kind == "adaptive",
        "texture refinement": texture_refinement not in (None, 1, "auto"),
    }
    return next((reason for reason, holds in reasons.items() if holds), None)


def large_volumes(scene: Scene) -> list[LargeVolume]:
    """Return the large ones of a scene's volumes."""
    return [volume for volume in scene.volumes if isinstance(volume, LargeVolume)]


def fits(scene: Scene) -> bool:
    """True if all samples of the large volumes of a scene fit in memory together."""
    large = large_volumes(scene)
    needed = sum(volume.levels[0].bytes for volume in large)
    return needed <= min((volume.memory for volume in large), default=needed)


def all_in_parts(scene: Scene) -> Scene:
    """Return the scene with every volume as a large one, the same object every time."""
    known: Scene | None = scene.__dict__.get("_all_in_parts")
    if known is None:
        memory = min((volume.memory for volume in large_volumes(scene)), default=None)
        added = tuple(replace(each, volume=in_chunks(each.volume, memory)) for each in scene.added)
        known = replace(scene, volume=in_chunks(scene.volume, memory), added=added)
        object.__setattr__(scene, "_all_in_parts", known)
    for volume in scene.volumes:
        volume.check_unchanged()
    return known
