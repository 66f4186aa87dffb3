"""Report of a picture in JSON types: what was drawn, in which slabs, textures and seconds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from texvol.opengl.contexts import Context
from texvol.rendering.error_control import Passes, smaller
from texvol.rendering.modelled import modelled
from texvol.rendering.scene_cache import SceneCache
from texvol.rendering.settings import Settings
from texvol.rendering.shadow_error import in_shadow
from texvol.scene.display import NUMBER_MODES
from texvol.scene.scene import CompleteScene
from texvol.slicing.slabs import slab_stacks, slabs_crossed

Size = tuple[int, int]
_MOST_COUNTED = 1 << 16  # rays on which slabs are counted one by one


def described(
    context: Context, cache: SceneCache, scene: CompleteScene, size: tuple[int, int], settings: Settings
) -> dict[str, Any]:
    """Return the entries of `--stats` that say what was drawn; those that a draw has to measure are not in it."""
    counts = [medium.empty_space.counts for medium in cache.volumes] if settings.skips(scene) else [(0, 0)]
    textures = [medium.textures for medium in cache.volumes]
    cells, visible_cells = map(sum, zip(*counts, strict=True))
    return described_alike(context, scene, size, settings) | {
        "texture_format": ", ".join(medium.baked.texel_format for medium in cache.volumes if medium.baked),
        "halvings": cache.volumes[0].halvings(scene.volume),
        "bricks_total": sum(len(each.bricks) for each in textures),
        "texture_bytes": sum(each.bytes for each in textures),
        "cells_total": cells,
        "cells_drawn": visible_cells,
    }


def described_alike(
    context: Context, scene: CompleteScene, size: tuple[int, int], settings: Settings
) -> dict[str, Any]:
    """Return the entries that do not depend on where the volumes are."""
    return {
        "renderer": context.renderer,
        "backend": context.backend,
        "size": list(size),
        "slab_thickness": settings.slab_thickness,
        "slabs": slab_stacks(scene.box, scene.camera, settings.slab_thickness, size).slab_count,
        "classification": scene.classification,
        "target_format": settings.target_format,
        "slicing": settings.slicing,
        "interpolation": settings.interpolation or "driver",
        "adaptive": settings.adaptive == "on",
        "texture_refinement": settings.texture_refinement,
        "shadow_nodes": settings.shadow_nodes if in_shadow(scene) else None,
        "early_termination": settings.early_termination,
        "modelled": modelled(scene),
    }


def sampled_slabs(
    count: Callable[[CompleteScene, Size, Settings], int] | None,
    scene: CompleteScene,
    size: Size,
    settings: Settings,
    passes: Passes,
) -> dict[str, Any]:
    """Count the sampled slabs by drawing once more with `count`, and the slabs that the rays cross in the box.

    Of a large picture those of a sixteenth of the rays stand for all. Those that the rays cross are of the thinnest
    slabs, if the picture has several passes, which are drawn whole. `tiles` says then how many pixels are drawn with
    slabs of which thickness.
    """
    if len(passes) == 1 and count is not None and size[0] * size[1] > _MOST_COUNTED:
        return _scaled(sampled_slabs(count, scene, smaller(size), settings, passes), scene, size, settings)
    each = [replace(settings, slab_thickness=thickness, regions=regions) for thickness, regions in passes]
    drawn: int | None
    if count is None:
        drawn = every = None
    elif scene.added:
        drawn = sum(count(scene, size, one) for one in each)
        every = count(scene, size, replace(settings, skip_empty=False, early_termination=0.0))
    else:
        every = slabs_crossed(scene.volume, scene.camera, settings.slab_thickness, size)
        drawn = every if scene.mode in NUMBER_MODES else sum(count(scene, size, one) for one in each)
    return {"samples": drawn, "samples_total": every} | ({"tiles": _tiles(passes)} if len(passes) > 1 else {})


def _scaled(few: dict[str, Any], scene: CompleteScene, size: Size, settings: Settings) -> dict[str, Any]:
    """Return the counts of a picture, given those of a small one of the same view."""
    pixels = size[0] * size[1] / np.prod(smaller(size))
    if scene.added:
        return {name: round(count * pixels) for name, count in few.items()}
    every = slabs_crossed(scene.volume, scene.camera, settings.slab_thickness, size)
    return {"samples": round(few["samples"] / max(few["samples_total"], 1) * every), "samples_total": every}


def _tiles(passes: Passes) -> list[dict[str, float]]:
    areas = [sum(width * height for _, _, width, height in regions or ()) for _, regions in passes]
    return [{"slab_thickness": thickness, "pixels": area} for (thickness, _), area in zip(passes, areas, strict=True)]
