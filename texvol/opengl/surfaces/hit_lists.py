"""Positions at which rays meet primitives, found in one pass over all primitives and kept as lists of the pixels.

Depth peeling goes over all primitives twice for each layer. Where there are storage buffers (OpenGL 4.3) a compute
shader goes over them once and appends each position to the list of its pixel; a layer is then the nearest position
behind the last one in each list. The positions and their order are those of peeling, to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import moderngl
import numpy as np

from texvol.opengl.shaders import WHOLE_TARGET, Programs, bind, draw_triangles, used
from texvol.opengl.surfaces.on_device import GROUP, Kind, OnDevice
from texvol.scene.shapes import Lines, Shape

_SINCE = 430  # OpenGL 4.3
_FEWEST = 10_000  # triangles and line segments; a few layers of fewer are peeled in less time
_HIT_BYTES = 16
_OF_HITS = ("LINES", "HALF_SPACES", "PERSPECTIVE", "LIT")  # switches of surface_hits.comp
_FIRST_HITS = 1 << 20  # that there is room for: it grows to those there are


def has_lists(gl: moderngl.Context, shapes: Sequence[Shape]) -> bool:
    """True if the driver has storage buffers, and shapes have so many primitives that lists take less time."""
    count = sum(len(shape.segments if isinstance(shape, Lines) else shape.triangles) for shape in shapes)
    return gl.version_code >= _SINCE and count >= _FEWEST


class HitLists:
    """Lists of the hits of one kind of primitives in a picture; `most_bytes` is what they may take on the device."""

    def __init__(self, gl: moderngl.Context, programs: Programs, most_bytes: int) -> None:
        self._gl, self._programs = gl, programs
        self._most = min(most_bytes, int(gl.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"])) // _HIT_BYTES
        self._pixels = 0
        self._buffers: dict[str, moderngl.Buffer] = {}

    def find(
        self,
        shapes: OnDevice,
        kind: Kind,
        in_front_of: moderngl.Texture,
        switches: Mapping[str, int],
        uniforms: dict[str, Any],
    ) -> bool:
        """Find all hits of primitives, or of opaque ones those that may be the nearest; False if there is no room."""
        shader = self._programs.compute(
            "surface_hits", {name: switches[name] for name in _OF_HITS} | {"POINT_LIGHTS": 0}
        )
        keeps_nearest = kind is shapes.opaque
        own = {"rectangle_count": kind.rectangle_count, "keeps_nearest": keeps_nearest}
        textures = {"table": shapes.table, "in_front_of": in_front_of}
        bind(shader, textures, used(shader, uniforms | {"picture_width": in_front_of.width}) | own)
        self._have_pixels(in_front_of.size)
        while True:
            self._buffers["lists"].clear()
            if keeps_nearest:
                self._buffers["nearest"].clear()
            self._bind(shapes)
            kind.buffer.bind_to_storage_buffer(3)
            shader.run(math.ceil(kind.rectangle_count / GROUP))
            self._gl.memory_barrier()
            count = int(np.frombuffer(self._buffers["lists"].read(4), np.uint32)[0])
            if count * _HIT_BYTES <= self._buffers["hits"].size:
                return True
            if count > self._most:
                return False
            self._have("hits", count * _HIT_BYTES)

    def draw_next(
        self,
        shapes: OnDevice,
        switches: Mapping[str, int],
        textures: Mapping[str, moderngl.Texture],
        uniforms: dict[str, Any],
    ) -> None:
        """Draw the nearest hits between two layers, with their colours, and take them out of the lists."""
        program = self._programs.program("surface_next", switches, "corner.vert")
        bind(program, textures, used(program, uniforms | {"picture_width": textures["behind"].width}))
        self._bind(shapes)
        draw_triangles(self._gl, program, WHOLE_TARGET, "2f", "in_position")
        self._gl.memory_barrier()

    def _bind(self, shapes: OnDevice) -> None:
        assert shapes.shape_of is not None, "there are no rectangles"
        for binding, buffer in enumerate((self._buffers["lists"], self._buffers["hits"], shapes.shape_of)):
            buffer.bind_to_storage_buffer(binding)
        self._buffers["nearest"].bind_to_storage_buffer(4)

    def _have_pixels(self, size: tuple[int, int]) -> None:
        """Have buffers for a picture of that size."""
        pixels = size[0] * size[1]
        if self._pixels != pixels:
            self._have("lists", 4 * (pixels + 1))
            self._have("nearest", 4 * pixels)
            self._have("hits", max(min(_FIRST_HITS, self._most), 1) * _HIT_BYTES)
            self._pixels = pixels

    def _have(self, name: str, count: int) -> None:
        if name in self._buffers:
            self._buffers.pop(name).release()
        self._buffers[name] = self._gl.buffer(reserve=count)

    def release(self) -> None:
        """Release the buffers."""
        for buffer in self._buffers.values():
            buffer.release()
        self._buffers, self._pixels = {}, 0
