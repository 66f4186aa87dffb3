"""Slices as Wilson, Van Gelder and Wilhelms drew them (1994), one textured polygon for each slab: read this file first.

The volume is classified once: each texel of its 3D texture holds the colour and opacity of a whole slab at a sample
(textures/slab_texture.py). Slabs lie between equally distant planes across the view. The polygon of a slab is where the
plane in its middle cuts the box, and has three to six corners, each with its position in the texture. Hardware does the
rest: it interpolates these positions, fetches a texel at each pixel (shaders/wilson.frag), and composites the polygons.
From back to front that would be *over*, colour + (1 - opacity) picture; bricks are drawn from front to back, and so are
their polygons here, each *under* what is there already: picture + (1 - opacity of the picture) colour.

Its known errors: slabs that the box cuts short are drawn whole, or not at all if their middle is outside; all rays take
the length that only the middle one of a perspective picture has; and each blend rounds to the target's format.
polygons.py draws the same polygons without the first two, slab stacks (shaders/slab_stack.glsl) blend in registers.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.drawing import Drawing, View
from texvol.opengl.shaders import bind
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick
from texvol.slicing.slabs import BOX_EDGES, SlabStacks, box_corners

Numbers = NDArray[np.float64]
_MOST_CORNERS = 6
_FAN = np.array([(0, i, i + 1) for i in range(1, _MOST_CORNERS - 1)]).reshape(-1)  # a polygon in triangles


def draw(compositor: Compositor, drawing: Drawing, brick: Brick, part: Numbers, slabs: SlabStacks) -> None:
    """Composite the slabs of a brick of the only volume behind the picture so far.

    `part` is the part of the box that shows anything, in fractions of the box, shape (2, 3).
    """
    view, drawn = drawing.view, drawing.first
    own = np.clip(drawing.own_range(brick), *part)
    _, polygons = sections(box_corners(drawn.volume, view.camera, own), slab_middles(view, slabs))
    if not polygons.size:
        return
    samples_per_box, first_sample, textures_per_sample = brick.texture_from_box
    polygons[..., 3:] = (polygons[..., 3:] * samples_per_box - first_sample) * textures_per_sample
    texel_scale = drawn.baked.uniforms(view.slab_thickness)["texel_scale"]
    uniforms = {"texel_scale": np.multiply(texel_scale, (*[drawing.color_scale] * 3, 1.0))}
    positions, projection = projected(polygons[..., :3], view, drawn.volume)
    program = compositor.program("wilson", {"FETCHED": int(drawn.fetched)}, "wilson.vert")
    bind(program, {"texels": drawn.samplers(brick)["texels"]}, uniforms | projection)
    corners = np.concatenate([positions, polygons[..., 3:]], axis=2)
    blending = "add" if drawing.count else "under"
    attributes = "3f 3f", "in_position", "in_texture_position"
    compositor.blend(program, blending, triangles(corners), *attributes, kind="wilson", slabs=len(polygons))


def slab_middles(view: View, slabs: SlabStacks) -> Numbers:
    """Return the depths of the planes in the middle of the slabs that are in front of the eye, world units."""
    middles = np.arange(slabs.first[0], slabs.last[-1]) + 0.5 if slabs.first.size else np.empty(0)
    return view.reference_depth + view.slab_thickness * middles[middles > slabs.eye_depth]


def sections(corners: Numbers, depths: Numbers) -> tuple[NDArray[np.bool_], Numbers]:
    """Cut a box by planes across the view; return which of them meet it, and the polygons of those.

    `corners`, of shape (8, n), are right, up, depth, and whatever else is linear in the box. Polygons are of shape
    (planes, 6, n): corners in order around; where there are fewer than six, the first one takes the other places.
    """
    behind = corners[:, 2] >= depths[:, np.newaxis]
    meets = np.logical_and(behind.any(axis=1), ~behind.all(axis=1))
    behind, depths = behind[meets], depths[meets]
    front, back = corners[BOX_EDGES[:, 0]], corners[BOX_EDGES[:, 1]]
    is_cut = behind[:, BOX_EDGES[:, 0]] != behind[:, BOX_EDGES[:, 1]]
    with np.errstate(divide="ignore", invalid="ignore"):
        fraction = np.where(is_cut, (depths[:, np.newaxis] - front[:, 2]) / (back[:, 2] - front[:, 2]), 0.0)
    points = front + fraction[..., np.newaxis] * (back - front)
    middle = points.mean(axis=1, keepdims=True, where=is_cut[..., np.newaxis])
    right, up = np.moveaxis(points[..., :2] - middle[..., :2], -1, 0)
    order = np.argsort(np.where(is_cut, np.arctan2(up, right), np.inf), axis=1)[:, :_MOST_CORNERS]
    polygons = np.take_along_axis(points, order[..., np.newaxis], axis=1)
    exists = np.take_along_axis(is_cut, order, axis=1)
    return meets, np.where(exists[..., np.newaxis], polygons, polygons[:, :1])


def projected(points: Numbers, view: View, volume: Volume) -> tuple[Numbers, dict[str, Any]]:
    """Return points (..., 3) of eye space as vertices, and the projection matrix for them as a uniform.

    Vertices count in radii of the box, and where rays are parallel from its middle: float32 has digits for that in a
    world of any size.
    """
    camera, unit = view.camera, volume.radius
    right, up, depth = np.moveaxis(points, -1, 0) / unit
    if camera.projection == "perspective":
        near, far = depth.min() / 2, depth.max() * 2
    else:
        depth = depth - float(camera.forward @ (volume.centre - camera.eye)) / unit
        near, far = -2.0, 2.0
    matrix = replace(camera, height=camera.height / unit).clip_from_eye(view.size[0] / view.size[1], near, far)
    return np.stack([right, up, -depth], axis=-1), {"projection": tuple(matrix.T.reshape(-1))}


def triangles(corners: Numbers) -> NDArray[np.float32]:
    """Return polygons (polygons, 6, n) as triangles, shape (polygons, 12, n), in the same order."""
    return np.ascontiguousarray(corners[:, _FAN], np.float32)
