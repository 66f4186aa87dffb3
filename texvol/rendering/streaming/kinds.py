"""Scenes that can be drawn part by part; of others all samples have to be in memory at once."""

from __future__ import annotations

from dataclasses import replace

from texvol.scene.large_volume import LargeVolume
from texvol.scene.lighting import casts_shadows
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError


def in_parts_or_memory(scene: Scene, texture_refinement: int | str | None = None) -> Scene:
    """Return the scene if it can be drawn as its volumes are, or else with all of them in memory.

    Raises
    ------
    InputError
        If a volume does not fit in memory; the message says what needs it there.
    """
    if not any(isinstance(volume, LargeVolume) for volume in scene.volumes):
        return scene
    reason = reason_for_memory(scene, texture_refinement)
    return scene if reason is None else in_memory(scene, reason)


def in_memory(scene: Scene, reason: str = "this") -> Scene:
    """Return the scene with all volumes in memory, the same object every time; `reason` is what needs them there.

    Raises
    ------
    InputError
        If a volume does not fit in memory.
    """
    if not any(isinstance(volume, LargeVolume) for volume in scene.volumes):
        return scene
    known: Scene | None = scene.__dict__.get("_in_memory")
    if known is None:
        try:
            added = tuple(replace(each, volume=_whole(each.volume)) for each in scene.added)
            known = replace(scene, volume=_whole(scene.volume), added=added)
        except InputError as error:
            raise InputError(f"{error} ({reason} cannot be drawn part by part)") from None
        object.__setattr__(scene, "_in_memory", known)
    return known


def reason_for_memory(scene: Scene, texture_refinement: int | str | None = None) -> str | None:
    """Return what of a scene needs all samples in memory; None if it can be drawn part by part."""
    reasons = {
        f"mode {scene.mode}": scene.mode != "composite",
        "several volumes": bool(scene.added),
        "a mask": scene.mask is not None,
        "meshes or lines": bool(scene.geometry),
        "a depth picture": scene.depth is not None,
        "shadows": casts_shadows(scene.lighting),
        "the adaptive gradient": scene.needs_gradient and scene.gradient.kind == "adaptive",
        "texture refinement": texture_refinement not in (None, 1, "auto"),
    }
    return next((reason for reason, holds in reasons.items() if holds), None)


def _whole(volume: Volume) -> Volume:
    return volume.whole if isinstance(volume, LargeVolume) else volume
