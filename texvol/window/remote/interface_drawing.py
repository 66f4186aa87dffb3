"""Drawing lists of Dear ImGui drawn by moderngl, in any OpenGL context.

Dear ImGui's own renderer finds OpenGL's functions in libGL, which knows no context of OSMesa, and which a machine
without a display need not have.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.opengl.shaders import load_program, set_uniforms
from texvol.window.home import Home

_LEAST = 1 << 16  # bytes of a buffer


class InterfaceDrawing:
    """Renderer of Dear ImGui's current context, in the OpenGL context of a screen."""

    def __init__(self, screen: Home) -> None:
        self._screen, self._gl = screen, screen.gl
        gl = self._gl
        self._program = load_program(gl, "interface")
        self._textures: dict[int, Any] = {}  # by OpenGL name; those of others are held elsewhere
        self._vertices: Any = None
        self._indices: Any = None
        self._array: Any = None
        io, platform = imgui.get_io(), imgui.get_platform_io()
        io.backend_flags |= imgui.BackendFlags_.renderer_has_textures.value
        most = int(gl.info["GL_MAX_TEXTURE_SIZE"])
        platform.renderer_texture_max_width = platform.renderer_texture_max_height = most

    def begin(self) -> None:
        """Do nothing before a frame."""

    def draw(self, data: Any) -> None:
        """Draw the lists into the screen's framebuffer."""
        target = self._screen.target
        for texture in imgui.get_platform_io().textures:
            if texture.status != imgui.ImTextureStatus.ok:
                self._update(texture)
        gl, (width, height) = self._gl, target.size
        target.use()
        gl.viewport = (0, 0, width, height)
        gl.enable_only(gl.BLEND)
        gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA
        gl.blend_equation = gl.FUNC_ADD
        set_uniforms(self._program, {"window_size": tuple(data.display_size)})
        try:
            for each in data.cmd_lists:
                self._draw_list(each, data.framebuffer_scale, target)
        finally:
            target.scissor = None

    def _draw_list(self, commands: Any, scale: Any, target: Any) -> None:
        self._fill(commands)
        width, height = target.size
        for command in commands.cmd_buffer:
            left, top, right, bottom = (round(edge * scale[axis % 2]) for axis, edge in enumerate(command.clip_rect))
            left, top, right, bottom = max(left, 0), max(top, 0), min(right, width), min(bottom, height)
            if left >= right or top >= bottom or not command.elem_count:
                continue
            target.scissor = left, height - bottom, right - left, bottom - top
            self._texture(command.tex_ref.get_tex_id()).use(0)
            self._array.render(self._gl.TRIANGLES, command.elem_count, first=command.idx_offset)

    def _fill(self, commands: Any) -> None:
        """Write vertices and indices to their buffers, which grow."""
        vertices = _content(commands.vtx_buffer, imgui.VERTEX_SIZE)
        indices = _content(commands.idx_buffer, imgui.INDEX_SIZE)
        if self._array is None or len(vertices) > self._vertices.size or len(indices) > self._indices.size:
            self._release()
            self._vertices = self._gl.buffer(reserve=max(2 * len(vertices), _LEAST), dynamic=True)
            self._indices = self._gl.buffer(reserve=max(2 * len(indices), _LEAST), dynamic=True)
            self._array = self._gl.vertex_array(
                self._program,
                [(self._vertices, "2f 2f 4f1", "position", "texture_position", "color")],
                index_buffer=self._indices,
                index_element_size=imgui.INDEX_SIZE,
            )
        self._vertices.write(vertices)
        self._indices.write(indices)

    def _release(self) -> None:
        for each in (self._array, self._vertices, self._indices):
            if each is not None:
                each.release()

    def _texture(self, number: int) -> Any:
        """Return the texture of an OpenGL name."""
        if number not in self._textures:
            self._textures[number] = self._gl.external_texture(number, (1, 1), 4, 0, "f1")
        return self._textures[number]

    def _update(self, texture: Any) -> None:
        """Create, change or release a texture of Dear ImGui's letters."""
        status = imgui.ImTextureStatus
        if texture.status == status.want_create:
            made = self._gl.texture((texture.width, texture.height), 4, texture.get_pixels_array().tobytes())
            made.repeat_x = made.repeat_y = False
            self._textures[made.glo] = made
            texture.set_tex_id(made.glo)
            texture.status = status.ok
        elif texture.status == status.want_updates:
            pixels = np.asarray(texture.get_pixels_array()).reshape(texture.height, texture.width, 4)
            for part in texture.updates:
                content = np.ascontiguousarray(pixels[part.y : part.y + part.h, part.x : part.x + part.w])
                self._textures[texture.tex_id].write(content, viewport=(part.x, part.y, part.w, part.h))
            texture.status = status.ok
        elif texture.status == status.want_destroy:
            self._textures.pop(texture.tex_id).release()
            texture.set_tex_id(0)
            texture.status = status.destroyed

    def close(self) -> None:
        """Release what Dear ImGui's context holds."""
        for texture in imgui.get_platform_io().textures:
            if texture.tex_id:
                texture.status = imgui.ImTextureStatus.want_destroy
                self._update(texture)
        imgui.get_io().backend_flags &= ~imgui.BackendFlags_.renderer_has_textures.value
        self._release()
        self._program.release()


def _content(buffer: Any, item: int) -> bytes:
    """Return the bytes of a vector of Dear ImGui's."""
    size = buffer.size() * item
    return ctypes.string_at(buffer.data_address(), size) if size else b""
