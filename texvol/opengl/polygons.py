"""Slices as wilson.py draws them, and exact: a polygon for each slab, and the slabs that the box cuts short apart.

A ray's first and last slab are mostly shorter than the others, each by as much as the ray has it. They are drawn with
one polygon over the whole box, as slab stacks draw them (shaders/slab_ends.frag), which also tells at each pixel the
slabs between them. The polygons of those are sections of a box that is larger by a pixel, since a driver may leave out
pixels at the edge of a polygon, and their fragments keep to the pixel's slabs (shaders/slab_polygon.frag). So the
picture is that of slab stacks, for every classification, light, mask and cut.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor, triangles_of
from texvol.opengl.drawing import AnyTexture, Drawing, View
from texvol.opengl.shaders import bind, used
from texvol.opengl.uniforms import box_from_world, picture_uniforms, single_switches, volume_uniforms
from texvol.opengl.wilson import projected, sections, slab_middles, triangles
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick
from texvol.slicing.slabs import SlabStacks, box_corners

Numbers = NDArray[np.float64]
_PIXELS = 1.5  # by which a section is larger than what it has to cover
_AT_ONCE = 64  # slabs composited before they are put behind the others, as in shaders/compositing.glsl
_LAYOUT = ("3f 1f", "in_position", "in_slab")


def draw(compositor: Compositor, drawing: Drawing, brick: Brick, part: Numbers, slabs: SlabStacks) -> None:
    """Composite the slabs of a brick of the only volume behind the picture so far.

    `part` is the part of the box that shows anything, in fractions of the box, shape (2, 3).
    """
    if not slabs.first.size:
        return
    drawn = replace(drawing.first, skips=None)  # polygons cannot skip cells: what is empty costs a fetch
    drawing = replace(drawing, volumes=(drawn,))
    switches, blending = single_switches(drawing, brick), "add" if drawing.count else "under"
    units: dict[str, AnyTexture] = drawn.samplers(brick) | drawing.interval
    uniforms = picture_uniforms(drawing, slabs) | volume_uniforms(drawing, drawn, brick)

    program = compositor.program("slab_ends", switches, "slab_stack.vert")
    bind(program, used(program, units), used(program, uniforms))
    whole_range, front, behind = compositor.layers((2, 4, 4), program, *triangles_of(slabs))

    compositor.composite(front, blending)
    program = compositor.program("slab_polygon", switches, "slab_polygon.vert")
    kind = ("slab_polygon", *sorted(switches.items()))
    for vertices, projection in _polygons(drawing, part, slabs):
        given = units | {"whole_range": whole_range}, uniforms | projection
        bind(program, *(used(program, each) for each in given))
        with compositor.apart(blending):
            compositor.blend(program, blending, vertices, *_LAYOUT, kind=kind, slabs=_AT_ONCE)
    compositor.composite(behind, blending)


def _polygons(
    drawing: Drawing, part: Numbers, slabs: SlabStacks
) -> Iterator[tuple[NDArray[np.float32], dict[str, Any]]]:
    """Yield triangles of the polygons, front to back, some at a time, and the projection matrix for them."""
    view, volume = drawing.view, drawing.first.volume
    middles = slab_middles(view, slabs)
    if not middles.size:
        return
    corners = box_corners(volume, view.camera, _larger(part, view, volume, float(middles[-1])))[:, :3]
    for start in range(0, middles.size, _AT_ONCE):
        depths = middles[start : start + _AT_ONCE]
        meets, polygons = sections(corners, depths)
        if not polygons.size:
            continue
        positions, projection = projected(polygons, view, volume)
        slab = np.floor((depths[meets] - view.reference_depth) / view.slab_thickness)
        of_slab = np.broadcast_to(slab[:, np.newaxis, np.newaxis], (*polygons.shape[:2], 1))
        yield triangles(np.concatenate([positions, of_slab], axis=2)), projection


def _larger(part: Numbers, view: View, volume: Volume, farthest: float) -> Numbers:
    """Return a part of the box that reaches farther by a pixel, and by half a slab on the most oblique ray."""
    camera = view.camera
    pixel = 2 * camera.half_height / view.size[1] * (farthest if camera.projection == "perspective" else 1.0)
    reach = _PIXELS * pixel + 0.5 * view.slab_thickness * camera.largest_obliquity(view.size)
    in_box = np.linalg.norm(box_from_world(volume), axis=1) * reach
    return np.array([part[0] - in_box, part[1] + in_box])
