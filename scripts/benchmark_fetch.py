"""A shader that does nothing but fetch: what the same rays through the same texture cost at the very least.

One polygon covers the picture; each fragment goes from where its ray enters the box to where it leaves, in steps of the
slab thickness, and sums up what it fetches. No transfer function, no opacity, no early end.
"""

from __future__ import annotations

import time
from types import TracebackType

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol import Scene
from texvol.opengl.contexts import open_context
from texvol.opengl.texture_store import MODERNGL_TYPES
from texvol.rendering.render import bake

_VERTEX = """
#version 330
in vec2 corner;
void main() { gl_Position = vec4(corner, 0.0, 1.0); }
"""
_FRAGMENT = """
#version 330
uniform sampler3D texels;
uniform vec2 picture_middle;
uniform vec3 point, point_per_column, point_per_row;           // depth 0, in the box
uniform vec3 velocity, velocity_per_column, velocity_per_row;  // per slab
out vec4 sum;
void main() {
    vec2 pixel = gl_FragCoord.xy - picture_middle;
    vec3 position = point + pixel.x * point_per_column + pixel.y * point_per_row;
    vec3 way = velocity + pixel.x * velocity_per_column + pixel.y * velocity_per_row;
    vec3 a = -position / way;
    vec3 b = (1.0 - position) / way;
    vec3 low = min(a, b), high = max(a, b);
    float entry = max(low.x, max(low.y, low.z)), leave = min(high.x, min(high.y, high.z));
    if (entry >= leave) discard;
    sum = vec4(0.0);
    float slab = floor(entry), end = ceil(leave);
    for (; slab < end; slab += 1.0) sum += textureLod(texels, position + (slab + 0.5) * way, 0.0);
}
"""


class PlainFetch:
    """The texture that texvol draws a scene from, and the program; on a context of its own."""

    def __init__(self, scene: Scene, slab_thickness: float, texel_format: str, size: tuple[int, int]) -> None:
        assert scene.transfer_function is not None
        self._scene, self._size = scene, size
        self._context = open_context()
        baked = bake(scene.completed(size), slab_thickness, texel_format)
        with self._context:
            gl = self._context.gl
            dtype = MODERNGL_TYPES[baked.texel_format]
            self._texture = gl.texture3d(scene.volume.dimensions, baked.formats["texels"][1], alignment=1, dtype=dtype)
            self._texture.repeat_x = self._texture.repeat_y = self._texture.repeat_z = False
            self._texture.filter = moderngl.LINEAR, moderngl.LINEAR
            self._texture.write(np.ascontiguousarray(baked.texels()), alignment=1)
            self._program = gl.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
            corners = np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)], np.float32)
            self._polygon = gl.vertex_array(self._program, [(gl.buffer(corners), "2f", "corner")])
            self._target = gl.framebuffer([gl.texture(size, 4, dtype="f4")])

    def seconds(self, slab_thickness: float) -> float:
        """Draw and read-back of a frame with steps of this depth, world units."""
        with self._context:
            start = time.perf_counter()
            self._draw(slab_thickness)
            self._target.read(components=4, dtype="f4")
            return time.perf_counter() - start

    def picture(self, slab_thickness: float) -> NDArray[np.float32]:
        """The sums, shape (height, width, 4), top row first."""
        with self._context:
            self._draw(slab_thickness)
            pixels = np.frombuffer(self._target.read(components=4, dtype="f4"), np.float32)
        return pixels.reshape(self._size[1], self._size[0], 4)[::-1]

    def _draw(self, slab_thickness: float) -> None:
        volume, size = self._scene.volume, self._size
        rays = self._scene.completed(size).camera.pixel_rays(size, volume.centre)
        box = volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]
        uniforms = {
            "picture_middle": (size[0] / 2, size[1] / 2),
            "point": 0.5 + box @ rays.point,
            "point_per_column": box @ rays.point_per_column,
            "point_per_row": box @ rays.point_per_row,
            "velocity": box @ rays.velocity * slab_thickness,
            "velocity_per_column": box @ rays.velocity_per_column * slab_thickness,
            "velocity_per_row": box @ rays.velocity_per_row * slab_thickness,
        }
        for name, value in uniforms.items():
            self._program[name] = tuple(value)
        gl = self._context.gl
        gl.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self._target.use()
        self._target.clear()
        self._texture.use(0)
        self._polygon.render(moderngl.TRIANGLE_STRIP)
        gl.finish()

    def __enter__(self) -> PlainFetch:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._context.release()
