"""Several volumes in one drawing: the rays go through all at once, and what they meet adds up, see several.frag.

Imported, compiled and allocated when a scene has more than one volume.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from texvol.opengl.compositor import (
    NO_LIGHT,
    NOTHING_SPECIAL,
    AnyTexture,
    Compositor,
    Drawing,
    brick_uniforms,
    light_uniforms_of,
    picture_uniforms,
    ray_uniforms,
    seen_uniforms,
)
from texvol.opengl.light_uniforms import light_switches
from texvol.slicing.bricks import Brick
from texvol.slicing.slabs import SlabStacks
from texvol.util.errors import InputError

Resources = Mapping[str, AnyTexture]
# Of the whole picture; the others are each volume's own.
_OF_ALL = ("color_scale", "least_transmittance")


def draw_several(
    compositor: Compositor,
    drawings: Sequence[Drawing],
    bricks: Sequence[Brick],
    stacks: SlabStacks,
    resources: Sequence[Resources],
) -> None:
    """Composite a brick of each volume behind what is in the picture; `resources` are their textures and tables.

    Raises
    ------
    InputError
        If the driver has no room for so many.
    """
    if not stacks.first.size:
        return
    first = drawings[0]
    units: dict[str, AnyTexture] = {}
    uniforms: dict[str, Any] = picture_uniforms(first, stacks)
    for number, (drawing, brick, its) in enumerate(zip(drawings, bricks, resources, strict=True)):
        textures = dict(its)
        own = ray_uniforms(drawing.volume, drawing.camera, drawing.size, drawing.slab_thickness, drawing.about)
        own |= seen_uniforms(drawing) | light_uniforms_of(drawing)
        if not brick.is_whole:
            own |= brick_uniforms(brick)
        if drawing.volume.labels:
            own["samples_per_edge"] = tuple(map(float, drawing.volume.dimensions))
        if drawing.light_transmittance is not None:
            textures["light_transmittance"] = drawing.light_transmittance
        if drawing.skips is not None:
            textures["skips"] = drawing.skips
            own["cells_per_box"] = drawing.cells_per_box
        units |= {f"{name}_{number}": texture for name, texture in textures.items()}
        uniforms |= {f"{name}_{number}": value for name, value in own.items() if name not in _OF_ALL}
    uniforms |= {name: value for name, value in seen_uniforms(first).items() if name in _OF_ALL}
    if first.interval is not None:
        units |= dict(zip(("near_positions", "far_positions"), first.interval, strict=True))
    if len(units) > compositor.most_textures:
        raise InputError(
            f"{len(drawings)} volumes take {len(units)} textures at once, and this driver has room for "
            f"{compositor.most_textures}"
        )
    compositor.draw_polygons(
        "several", switches_of(drawings, bricks), stacks, units, uniforms, "add" if first.count else "under"
    )


def switches_of(drawings: Sequence[Drawing], bricks: Sequence[Brick]) -> dict[str, int]:
    """Switches of several.frag."""
    first = drawings[0]
    switches = {
        "VOLUMES": len(drawings),
        "PERSPECTIVE": int(first.camera.projection == "perspective"),
        "HALF_SPACES": len(first.cutting),
        "INTERVAL": int(first.interval is not None),
        "CAPS": int(first.cutting.caps),
        "CUE": int(first.depth_cue is not None),
        "COUNT": int(first.count),
        "HALVES": 0,
        "SHALLOW": 0,  # depths of several add up
    }
    for number, (drawing, brick) in enumerate(zip(drawings, bricks, strict=True)):
        own = NO_LIGHT | NOTHING_SPECIAL | drawing.baked.switches(math.inf, 1.0)
        own |= light_switches(drawing.lighting)
        own |= {"BRICKS": int(not brick.is_whole), "SKIPS": int(drawing.skips is not None)}
        own["FACES"] = int(drawing.volume.labels)
        for other in ("WHOLE_SLABS", "SHALLOW"):
            own.pop(other)
        switches["HALVES"] |= int(own["CLASSIFICATION"] == 3)
        switches |= {f"{name}_{number}": value for name, value in own.items()}
    return switches
