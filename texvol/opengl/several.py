"""Several volumes in one drawing: each ray goes through all of them at once, and their media add up; see several.glsl.

Imported, compiled and allocated when a scene has more than one volume, or labels.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from texvol.opengl.compositor import Compositor
from texvol.opengl.drawing import AnyTexture, Drawing
from texvol.opengl.uniforms import (
    NO_LIGHT,
    NOTHING_SPECIAL,
    cell_uniforms,
    picture_switches,
    picture_uniforms,
    ray_uniforms,
    volume_switches,
    volume_uniforms,
)
from texvol.slicing.bricks import BEYOND, Brick
from texvol.slicing.slabs import SlabStacks
from texvol.util.errors import InputError

# Uniforms of the whole picture; the others have a number for each volume.
_OF_ALL = ("color_scale", "least_transmittance")


def draw_several(compositor: Compositor, drawing: Drawing, bricks: Sequence[Brick], stacks: SlabStacks) -> None:
    """Composite a brick of each volume behind the picture so far.

    Raises
    ------
    InputError
        If the driver has no room for that many textures.
    """
    if not stacks.first.size:
        return
    units: dict[str, AnyTexture] = {**drawing.interval}
    room = 0  # volumes, the first ones
    switches = switches_of(drawing, bricks)
    uniforms = picture_uniforms(drawing, stacks) | _block_uniforms(drawing)
    is_block = drawing.block is not None
    drawing = replace(drawing, block=None)  # of whole slabs, not of each volume
    for number, (drawn, brick) in enumerate(zip(drawing.volumes, bricks, strict=True)):
        units |= {f"{name}_{number}": texture for name, texture in drawn.samplers(brick).items()}
        room += len(units) <= compositor.most_textures
        own = volume_uniforms(drawing, drawn, brick)
        if drawn.volume.nearest:
            own["samples_per_edge"] = tuple(map(float, drawn.volume.dimensions))
        own |= cell_uniforms(drawing, drawn, brick)
        if is_block and "brick_low" in own:  # it is the block that decides which slabs are drawn
            own |= {"brick_low": (-BEYOND,) * 3, "brick_high": (BEYOND,) * 3}
        uniforms |= {name if name in _OF_ALL else f"{name}_{number}": value for name, value in own.items()}
    if room < len(drawing.volumes):
        raise InputError(
            f"{len(drawing.volumes)} volumes are more than this driver draws at once: they need {len(units)} textures, "
            f"and it has {compositor.most_textures}, enough for the first {room}; hide or leave out others"
        )
    blending = "add" if drawing.count else "under"
    compositor.draw_polygons("several", switches, stacks, units, uniforms, blending)


def _block_uniforms(drawing: Drawing) -> dict[str, Any]:
    if drawing.block is None:
        return {}
    of_frame = ray_uniforms(drawing.frame or drawing.first.volume, drawing.view)
    return of_frame | {"block_low": tuple(drawing.block[0]), "block_high": tuple(drawing.block[1])}


def switches_of(drawing: Drawing, bricks: Sequence[Brick]) -> dict[str, int]:
    """Switches of several.glsl."""
    switches = picture_switches(drawing) | {
        "VOLUMES": len(drawing.volumes),
        "CAPS": int(drawing.cutting.caps),
        "BLOCK": int(drawing.block is not None),
        "HALVES": 0,
        "SHALLOW": 0,  # depths of several volumes add up
    }
    for number, (drawn, brick) in enumerate(zip(drawing.volumes, bricks, strict=True)):
        own = NO_LIGHT | NOTHING_SPECIAL | drawn.baked.switches(math.inf, 1.0) | volume_switches(drawn, brick)
        own["FACES"] = int(drawn.volume.nearest)
        for other in ("WHOLE_SLABS", "SHALLOW"):
            own.pop(other)
        switches["HALVES"] |= int(own["CLASSIFICATION"] == 3)
        switches |= {f"{name}_{number}": value for name, value in own.items()}
    return switches
