"""The compositor keeps what is on the device: it uploads texels, draws slab stacks, composites and reads back.

Stacks are drawn front to back and blended *under* what is there, so that a pixel holds the premultiplied colour and
opacity of everything in front of the next stack:

    picture ← picture + (1 - picture.a) stack
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.camera import Camera
from texvol.contexts import Context
from texvol.errors import InputError
from texvol.shaders import load_program, set_uniforms
from texvol.slab_texture import SlabTexture
from texvol.slicing import SlabStacks
from texvol.value_texture import ValueTexture
from texvol.volume import Volume

TARGET_FORMATS = ("rgba8", "rgba16f", "rgba32f")
_MODERNGL_TYPES = {"rgba8": "f1", "rgba16f": "f2", "rgba32f": "f4", "r16": "nu2", "r16f": "f2", "r32f": "f4"}

BakedTexture = SlabTexture | ValueTexture


@dataclass
class DeviceTexture:
    """A baked texture on the device; whoever uploaded it releases it."""

    baked: BakedTexture  # without its texels
    texture: moderngl.Texture3D
    tables: dict[str, moderngl.Texture]

    def release(self) -> None:
        """Give the textures' memory back."""
        self.texture.release()
        for table in self.tables.values():
            table.release()


class Compositor:
    """Programs and targets on one context; every method needs the context to be current."""

    def __init__(self, context: Context) -> None:
        self._gl = context.gl
        self._programs: dict[tuple[tuple[str, int], ...], moderngl.Program] = {}
        self._target: moderngl.Framebuffer | None = None
        self._target_key: tuple[tuple[int, int], str] | None = None
        self._color_scale = 1.0

    @property
    def largest_picture(self) -> int:
        """Most pixels of a picture along one side."""
        info = self._gl.info
        return int(min(info["GL_MAX_TEXTURE_SIZE"], *info["GL_MAX_VIEWPORT_DIMS"]))

    def upload(self, baked: BakedTexture) -> DeviceTexture:
        """The texels as a 3D texture, interpolated trilinearly, clamped at the edge, and its tables.

        Raises
        ------
        InputError
            If the volume has more samples along an axis than the driver's 3D textures.
        """
        nz, ny, nx, components = baked.texels.shape
        largest = self._gl.info["GL_MAX_3D_TEXTURE_SIZE"]
        if max(nx, ny, nz) > largest:
            raise InputError(
                f"the volume has {nx} x {ny} x {nz} samples, and this driver's 3D textures hold at most {largest} "
                "along an axis"
            )
        dtype = _MODERNGL_TYPES[baked.texel_format]
        texture = self._gl.texture3d((nx, ny, nz), components, baked.texels, alignment=1, dtype=dtype)
        texture.repeat_x = texture.repeat_y = texture.repeat_z = False
        texture.filter = moderngl.LINEAR, moderngl.LINEAR
        return DeviceTexture(baked.without_texels(), texture, self._upload_tables(baked))

    def upload_transfer_function(self, texture: DeviceTexture, baked: BakedTexture) -> None:
        """Put another transfer function's tables beside texels that don't depend on it."""
        tables = self._upload_tables(baked)
        for resource in texture.tables.values():
            resource.release()
        texture.baked, texture.tables = baked.without_texels(), tables

    def _upload_tables(self, baked: BakedTexture) -> dict[str, moderngl.Texture]:
        tables = {}
        for name, numbers in baked.tables.items():
            rows, columns, components = numbers.shape
            tables[name] = self._gl.texture((columns, rows), components, np.ascontiguousarray(numbers), dtype="f4")
            tables[name].filter = moderngl.NEAREST, moderngl.NEAREST
        return tables

    def draw(
        self,
        device_texture: DeviceTexture,
        stacks: SlabStacks,
        volume: Volume,
        camera: Camera,
        size: tuple[int, int],
        target_format: str = "rgba32f",
        color_scale: float = 1.0,
    ) -> None:
        """Composite the stacks into the target, colours times `color_scale`; `picture` reads it and takes that back."""
        gl = self._gl
        self._color_scale = color_scale
        target = self._target_of(size, target_format)
        target.use()
        target.clear(0.0, 0.0, 0.0, 0.0)
        if not stacks.slab_count:
            return
        baked = device_texture.baked
        program = self._program(baked.switches | {"PERSPECTIVE": int(camera.projection == "perspective")})
        units = {"texels": device_texture.texture} | device_texture.tables
        for unit, resource in enumerate(units.values()):
            resource.use(unit)
        set_uniforms(
            program,
            {name: unit for unit, name in enumerate(units)}
            | {"color_scale": color_scale}
            | baked.uniforms(stacks.slab_thickness)
            | _ray_uniforms(stacks, volume, camera, size),
        )
        gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        gl.enable(moderngl.BLEND)
        gl.blend_equation = (moderngl.FUNC_ADD, moderngl.FUNC_ADD)
        gl.blend_func = (moderngl.ONE_MINUS_DST_ALPHA, moderngl.ONE)
        vertices = gl.buffer(_triangles(stacks))
        array = gl.vertex_array(program, [(vertices, "2f 2f", "in_position", "in_slab_range")])
        try:
            array.render(moderngl.TRIANGLES)
        finally:
            array.release()
            vertices.release()

    def finish(self) -> None:
        """Wait until everything asked for is drawn."""
        self._gl.finish()

    def picture(self) -> NDArray[np.float32]:
        """What was drawn last: (height, width, 4) float32, premultiplied, linear, top row first."""
        assert self._target is not None and self._target_key is not None, "nothing has been drawn yet"
        (width, height), _ = self._target_key
        pixels = np.empty((height, width, 4), np.float32)
        self._target.read_into(pixels, components=4, dtype="f4", alignment=1)
        picture = np.ascontiguousarray(pixels[::-1])
        if self._color_scale != 1.0:
            picture[..., :3] /= self._color_scale
        return picture

    def release(self) -> None:
        """Give programs and targets back."""
        for program in self._programs.values():
            program.release()
        self._programs.clear()
        self._release_target()

    def _program(self, switches: dict[str, int]) -> moderngl.Program:
        key = tuple(switches.items())
        if key not in self._programs:
            self._programs[key] = load_program(self._gl, "slab_stack", defines=switches)
        return self._programs[key]

    def _target_of(self, size: tuple[int, int], target_format: str) -> moderngl.Framebuffer:
        key = (size, target_format)
        if self._target is None or self._target_key != key:
            self._release_target()
            try:
                texture = self._gl.texture(size, 4, dtype=_MODERNGL_TYPES[target_format])
                self._target = self._gl.framebuffer([texture])
            except moderngl.Error:
                raise InputError(f"size {size[0]}x{size[1]}: this driver has no room for such a picture") from None
            self._target_key = key
        return self._target

    def _release_target(self) -> None:
        if self._target is not None:
            self._gl.screen.use()  # moderngl binds the last framebuffer again, also one that is gone
            for attachment in self._target.color_attachments:
                attachment.release()
            self._target.release()
        self._target = self._target_key = None


def _triangles(stacks: SlabStacks) -> NDArray[np.float32]:
    """Every polygon as a fan of triangles: (x, y, first slab, last slab) for each corner, front to back."""
    count, sides, _ = stacks.polygons.shape
    fan = np.array([(0, i, i + 1) for i in range(1, sides - 1)]).reshape(-1)
    vertices = np.empty((count, fan.size, 4), np.float32)
    vertices[..., :2] = stacks.polygons[:, fan]
    vertices[..., 2] = stacks.first[:, np.newaxis]
    vertices[..., 3] = stacks.last[:, np.newaxis]
    return vertices


def _ray_uniforms(stacks: SlabStacks, volume: Volume, camera: Camera, size: tuple[int, int]) -> dict[str, Any]:
    """Rays in texture coordinates per slab thickness; worked out in float64."""
    rays = camera.pixel_rays(size, volume.centre)
    texture_from_world = volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]
    per_slab = texture_from_world * stacks.slab_thickness
    uniforms: dict[str, Any] = {
        "eye_depth": stacks.eye_depth,
        "picture_middle": (size[0] / 2, size[1] / 2),
        "point": tuple(0.5 + texture_from_world @ rays.point),
        "point_per_column": tuple(texture_from_world @ rays.point_per_column),
        "point_per_row": tuple(texture_from_world @ rays.point_per_row),
        "velocity": tuple(per_slab @ rays.velocity),
    }
    if camera.projection == "perspective":
        uniforms["velocity_per_column"] = tuple(per_slab @ rays.velocity_per_column)
        uniforms["velocity_per_row"] = tuple(per_slab @ rays.velocity_per_row)
        uniforms["tangent_per_pixel"] = 2 * camera.half_height / size[1]
    return uniforms
