"""Shapes of a scene on the device, as they lie in a picture: a table of their numbers, and where to look for each.

A primitive is looked for in the two triangles of its cover, which the driver rasterises, or in rectangles of pixels,
each by one invocation of a compute shader (hit_lists.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.opengl.surfaces.on_screen import Pixels, Primitives, primitives_of
from texvol.scene.camera import Camera
from texvol.scene.shapes import Lines, Mesh, Shape
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

TABLE_WIDTH = 4096
GROUP = 64  # rectangles of one group of invocations, see surface_hits.comp
MOST_RECTANGLES = GROUP * 65535  # OpenGL promises so many groups
# Translucent lines are seen once on a ray; which it has passed are bits of a float32's whole numbers.
_MOST_TRANSLUCENT_LINES = 24
_SIDE = 8  # pixels, of a rectangle at most: invocations beside each other wait for the one that takes longest


class Kind(NamedTuple):
    """The opaque or the translucent primitives of a picture."""

    buffer: moderngl.Buffer  # corners of covers, for surface.vert; or rectangles, for surface_hits.comp
    rectangle_count: int  # 0: they are covers


class OnDevice:
    """The shapes of a scene as they lie in a picture.

    `in_rectangles`: True if they are to be looked for in rectangles of pixels, unless these are too many.

    Raises
    ------
    InputError
        If there are more than the driver has room for.
    """

    def __init__(
        self,
        gl: moderngl.Context,
        geometry: Sequence[Shape],
        volume: Volume,
        camera: Camera,
        size: tuple[int, int],
        slab_thickness: float,
        lit: bool,
        *,
        in_rectangles: bool,
    ) -> None:
        in_view = geometry, volume, camera, size, slab_thickness
        primitives = primitives_of(*in_view, covered=not in_rectangles, lit=lit)
        if in_rectangles and _tiles_of(primitives).prod(axis=1).sum() > MOST_RECTANGLES:
            in_rectangles, primitives = False, primitives_of(*in_view, lit=lit)
        self.in_rectangles = in_rectangles
        self.count = len(geometry)
        self.any_lines = any(isinstance(shape, Lines) for shape in geometry)
        self.table = _table(gl, geometry, primitives)
        self.shape_of = (
            gl.buffer(primitives.shape.astype(np.uint32)) if in_rectangles and len(primitives.shape) else None
        )
        is_opaque = np.array([shape.opacity == 1 for shape in geometry])[primitives.shape]
        self.opaque, self.translucent = (self._kind(gl, primitives, which, size) for which in (is_opaque, ~is_opaque))

    def _kind(
        self, gl: moderngl.Context, primitives: Primitives, which: NDArray[np.bool_], size: tuple[int, int]
    ) -> Kind | None:
        if not which.any():
            return None
        if not self.in_rectangles:
            return Kind(gl.buffer(_vertices_of(primitives, which, size)), 0)
        rectangles = _rectangles_of(primitives, which)
        return Kind(gl.buffer(rectangles), len(rectangles))

    def release(self) -> None:
        """Release everything."""
        kinds = [kind.buffer for kind in (self.opaque, self.translucent) if kind is not None]
        for each in (self.table, self.shape_of, *kinds):
            if each is not None:
                each.release()


def _table(gl: moderngl.Context, shapes: Sequence[Shape], primitives: Primitives) -> moderngl.Texture:
    """Texture of the numbers of shapes and primitives, see surface_table.glsl."""
    parts = [_texels_of_shapes(shapes), primitives.texels.reshape(-1, 4)]
    used, count = sum(map(len, parts)), len(primitives.shape)
    rows = -(-used // TABLE_WIDTH)
    if rows > int(gl.info["GL_MAX_TEXTURE_SIZE"]) or count >= 1 << 24:
        raise InputError(f"{count} triangles and lines are in view, more than this driver has memory for")
    texels = np.empty((rows * TABLE_WIDTH, 4), np.float32)
    np.concatenate(parts, out=texels[:used])
    texels[used:] = 0.0
    table = gl.texture((TABLE_WIDTH, rows), 4, texels, dtype="f4")
    table.filter = moderngl.NEAREST, moderngl.NEAREST
    return table


def _texels_of_shapes(shapes: Sequence[Shape]) -> NDArray[np.float32]:
    """Return two texels for each shape: colour and opacity; 1 if it is lit, cut, lines, and the bit that it has."""
    texels = np.zeros((len(shapes), 2, 4), np.float32)
    once = [number for number, shape in enumerate(shapes) if isinstance(shape, Lines) and shape.opacity < 1]
    if len(once) > _MOST_TRANSLUCENT_LINES:
        raise InputError(f"scene: at most {_MOST_TRANSLUCENT_LINES} Lines can be translucent, got {len(once)}")
    for number, shape in enumerate(shapes):
        texels[number, 0] = *shape.color, shape.opacity
        bit = float(1 << once.index(number)) if number in once else 0.0
        texels[number, 1] = isinstance(shape, Mesh) and shape.lit, shape.cut, isinstance(shape, Lines), bit
    return texels.reshape(-1, 4)


def _vertices_of(primitives: Primitives, which: NDArray[np.bool_], size: tuple[int, int]) -> NDArray[np.float32]:
    """Return the corners of the covers of chosen primitives: x, y, number of the primitive, number of its shape."""
    vertices = np.empty((int(which.sum()), 6, 4), np.float32)
    vertices[..., :2] = primitives.covers[which] / (np.array(size) / 2)
    vertices[..., 2] = np.flatnonzero(which)[:, np.newaxis]
    vertices[..., 3] = primitives.shape[which, np.newaxis]
    halves = vertices.reshape(-1, 3, 4)  # where a single triangle covers the primitive, the other one is a point
    return halves[(halves[:, 0] != halves[:, 1]).any(axis=1)]


def _tiles_of(primitives: Primitives) -> Pixels:
    """Numbers of tiles across and upwards that primitives are looked for in."""
    return -(-(primitives.pixels[:, 1] - primitives.pixels[:, 0]) // _SIDE)


def _rectangles_of(primitives: Primitives, which: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """Return the rectangles of pixels of chosen primitives, see surface_hits.comp, in the order of the primitives."""
    numbers, tiles, pixels = np.flatnonzero(which), _tiles_of(primitives)[which], primitives.pixels[which]
    counts = tiles.prod(axis=1)
    of = np.repeat(np.arange(len(tiles)), counts)
    tile = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
    corner = pixels[of, 0] + _SIDE * np.stack([tile % tiles[of, 0], tile // tiles[of, 0]], axis=1)
    sides = np.minimum(pixels[of, 1] - corner, _SIDE)
    return np.column_stack([numbers[of], *(pair[:, 0] | pair[:, 1] << 16 for pair in (corner, sides))]).astype(
        np.uint32
    )
