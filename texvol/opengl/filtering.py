"""Precision of the weights with which a driver interpolates textures, measured by drawing a ramp.

A texture of two texels, 0 and 1, is magnified to thousands of pixels, and each should be the fraction of the way at
which it is. With weights of b bits there are 2^b steps, and pixels are off by up to 2^-(b + 1), or 2^-b if the
hardware cuts bits off. Values and whole numbers of 8 bits are measured, which drivers interpolate in different ways.
"""

from __future__ import annotations

from pathlib import Path

import moderngl
import numpy as np

from texvol.opengl.contexts import Context
from texvol.opengl.shaders import FOLDER, WHOLE_TARGET, bind, draw_triangles, load_program, release_target
from texvol.opengl.texture_store import interpolated_texture

COARSE = 2.0**-17  # error of weights of 16 bits: more is less than hides behind the error of any fine picture
_PIXELS = 4096
_FORMATS = {"r32f": np.float32, "r8": np.uint8}


def weights_error(context: Context, folder: Path = FOLDER) -> float:
    """Return the largest error of the driver's weights; `context` is current, `folder` is that of the shader files."""
    program = load_program(context.gl, "weights", defines={"FETCHED": 0}, vertex="corner.vert", folder=folder)
    try:
        return max(_error(context, program, texel_format) for texel_format in _FORMATS)
    finally:
        program.release()


def bits_of(error: float) -> int:
    """Return about how many bits weights of an error have behind the binary point."""
    return int(np.clip(np.round(-np.log2(max(error, 2.0**-25))) - 1, 0, 24))


def _error(context: Context, program: moderngl.Program, texel_format: str) -> float:
    gl = context.gl
    largest = 255 if texel_format == "r8" else 1
    texture = interpolated_texture(context, (2, 1, 1), texel_format, 1)
    target = gl.framebuffer([gl.texture((_PIXELS, 1), 1, dtype="f4")])
    try:
        texture.write(np.array([0, largest], _FORMATS[texel_format]))
        target.use()
        gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
        bind(program, {"texels": texture}, {"way_per_pixel": 1 / _PIXELS})
        draw_triangles(gl, program, WHOLE_TARGET, "2f", "in_position")
        drawn = np.empty(_PIXELS, np.float32)
        target.read_into(drawn, components=1, dtype="f4", alignment=1)
    finally:
        release_target(gl, target)
        texture.release()
    return float(np.abs(drawn - (np.arange(_PIXELS) + 0.5) / _PIXELS).max())
