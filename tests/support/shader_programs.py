"""Programs of a few lines, and switches of the shaders."""

from __future__ import annotations

import numpy as np

from texvol.opengl.contexts import Context
from texvol.opengl.shaders import ShaderError, load_program
from texvol.opengl.uniforms import NO_LIGHT, NOTHING_SPECIAL

VERTEX = """// comments may stand first
#version 330
in vec2 corner;
void main() { gl_Position = vec4(corner, 0.0, 1.0); }
"""


def one_pixel(context: Context, program: object) -> float:
    """Red of a pixel that the program draws."""
    gl = context.gl
    corners = gl.buffer(np.array([-1, -1, 3, -1, -1, 3], "f4"))
    target = gl.framebuffer([gl.texture((1, 1), 4, dtype="f4")])
    target.use()
    gl.vertex_array(program, [(corners, "2f", "corner")]).render()
    red = float(np.frombuffer(target.read(components=4, dtype="f4"), np.float32)[0])
    gl.screen.use()
    return red


EITHER = (0, 1)
ONE_LIGHT = {"LIT": 1, "HEAD_LIGHT": 1}
# The switches of light on their own, and all together.
LIGHTS: list[dict[str, int]] = [
    {},
    {"LIT": 1},
    *(ONE_LIGHT | {"SPECULAR": specular, "TWO_SIDED": sides} for specular in (0, 1, 6) for sides in EITHER),
    {"LIT": 1, "DIRECTIONAL_LIGHTS": 1},
    {"LIT": 1, "POINT_LIGHTS": 1, "FALL_OFF": 1},
    {"LIT": 1, "DIRECTIONAL_LIGHTS": 2, "POINT_LIGHTS": 2, "SHADOWS": 1},
    {"LIT": 1, "HEAD_LIGHT": 1, "DIRECTIONAL_LIGHTS": 9, "POINT_LIGHTS": 3, "SPECULAR": 1, "TWO_SIDED": 1},
]


def load(name: str, context: Context, switches: dict[str, int]) -> None:
    """Compile a program of shaders/ and free it; an error shows its switches."""
    vertex = {"shadow": "corner.vert", "slab_polygon": "slab_polygon.vert"}.get(name, "slab_stack.vert")
    try:
        load_program(context.gl, name, defines=switches, vertex=vertex)
    except ShaderError as error:
        error.add_note(f"{name}: { {name: value for name, value in switches.items() if value} }")
        raise
    context.gl.gc()


WHOLE = {"HALF_SPACES": 0, "INTERVAL": 0}
MEDIUM = NO_LIGHT | NOTHING_SPECIAL | WHOLE | {"CAPS": 0, "AT_ONCE": 2, "DIVIDES": 0}


# For what is at a place of a volume, whatever draws it.
OF_SLABS = ("WHOLE_SLABS", "CAPS", "AT_ONCE", "DIVIDES", *WHOLE)
OF_A_VOLUME: list[dict[str, int]] = [
    {name: value for name, value in (MEDIUM | each).items() if name not in OF_SLABS}
    | {"CUE": 1, "PERSPECTIVE": 1, "BRICKS": 0, "FETCHED": 0}
    for each in (
        *({"CLASSIFICATION": classification} for classification in range(4)),
        {"CLASSIFICATION": 2, "RAMPS": 2, "WEIGHTS": 1},
        {"CLASSIFICATION": 2, "GRADIENT": 1} | LIGHTS[-1] | {"MODULATIONS": 3, "GRADED": 3, "CONTOURS": 3},
        {"CLASSIFICATION": 3, "GRADIENT": 2, "WEIGHTS": 1} | LIGHTS[-1],
        {"CLASSIFICATION": 3, "RAMPS": 2},
    )
]
