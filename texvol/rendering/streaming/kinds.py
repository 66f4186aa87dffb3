"""Scenes that can be drawn part by part; of others all samples have to be in memory at once.

Parts are of one volume. In modes composite and isosurface they are composited front to back; in the modes whose
pictures are numbers (xray, average, mip, minip) each is drawn by itself, and the numbers are added, or the largest or
least is kept.
"""

from __future__ import annotations

from texvol.scene.large_volume import LargeVolume
from texvol.scene.lighting import casts_shadows
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import check_type


def drawable(scene: Scene, size: tuple[int, int], texture_refinement: int | str | None = None) -> Scene:
    """Return `in_parts_or_memory` of a scene, with its look, that a picture of the size can show.

    Raises
    ------
    InputError
        If it is not a scene, the picture cannot show it, or a volume does not fit in memory.
    """
    check_type("scene", scene, Scene)
    scene.check_for(size)
    return in_parts_or_memory(scene.looked, texture_refinement)


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
    return scene if reason is None else scene.in_memory(reason)


def reason_for_memory(scene: Scene, texture_refinement: int | str | None = None) -> str | None:
    """Return what of a scene needs all samples in memory; None if it can be drawn part by part.

    Pictures of modes other than composite are drawn so only where the samples do not fit: in memory they take less
    time, and parts are of the level that pixels show, whose means have other extremes and surfaces.
    """
    reasons = {
        f"mode {scene.mode}": scene.mode != "composite" and fits(scene.volume),
        "several volumes": bool(scene.added),
        "a mask": scene.mask is not None,
        "meshes or lines": bool(scene.geometry),
        "a depth picture": scene.depth is not None,
        "shadows": scene.mode == "composite" and casts_shadows(scene.lighting),
        "the adaptive gradient": scene.needs_gradient and scene.gradient.kind == "adaptive",
        "texture refinement": texture_refinement not in (None, 1, "auto"),
    }
    return next((reason for reason, holds in reasons.items() if holds), None)


def fits(volume: Volume) -> bool:
    """True if all samples of a volume fit in its memory."""
    return not isinstance(volume, LargeVolume) or volume.levels[0].bytes <= volume.memory
