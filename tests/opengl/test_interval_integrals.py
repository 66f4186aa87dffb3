"""Emission and absorption on an interval of linear medium: the shader against quadrature in float64."""

from __future__ import annotations

import shutil
from pathlib import Path

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from texvol.opengl.contexts import Context
from texvol.opengl.shaders import FOLDER, load_program

SIDE = 65
FRONT, BEHIND = np.array([0.0, 0.4, 1.0]), np.array([1.0, 0.5, 0.0])
# Columns are optical depths from 0 on; rows are how extinction leans, from falling to 0 to rising from 0.
FRAGMENT = f"""#version 330
#include "integrate.glsl"
uniform float deepest;
out vec4 color;
void main() {{
    vec2 at = (gl_FragCoord.xy - 0.5) / {SIDE - 1.0};
    vec4 medium = vec4(0.0, 0.4, 1.0, 2.0 - 2.0 * at.y);
    vec4 behind = vec4(1.0, 0.5, 0.0, 2.0 * at.y);
    color = vec4(0.0);
    float left = 1.0;
    for (;;) {{
        float crossed = cross_interval(color, medium, behind, left * at.x * deepest);
        if (crossed >= 1.0) break;
        left *= 1.0 - crossed;
    }}
}}
"""


def expected(deepest: float, emissive: bool) -> NDArray[np.float64]:
    """Colours and opacities of the pixels, shape (SIDE, SIDE, 4)."""
    points, weights = np.polynomial.legendre.leggauss(120)
    t, weights = (points + 1) / 2, weights / 2
    depth = np.linspace(0, deepest, SIDE)[:, np.newaxis]
    lean = np.linspace(-1, 1, SIDE)[:, np.newaxis, np.newaxis]
    reached = np.exp(-depth * (t + lean * (t**2 - t)))
    emitted = reached * depth * (1.0 if emissive else 1 + lean * (2 * t - 1)) * weights
    color = (emitted @ (1 - t))[..., np.newaxis] * FRONT + (emitted @ t)[..., np.newaxis] * BEHIND
    return np.concatenate([color, np.broadcast_to(-np.expm1(-depth), (SIDE, SIDE, 1))], axis=2)


def drawn(context: Context, folder: Path, deepest: float, switches: dict[str, int]) -> NDArray[np.float32]:
    """The same by the shader."""
    shutil.copytree(FOLDER, folder, dirs_exist_ok=True)
    (folder / "interval.frag").write_text(FRAGMENT)
    gl = context.gl
    defines = {"RAMPS": 2, "SPREAD": 0, "MISSING": 0, "FETCHED": 0} | switches
    program = load_program(gl, "interval", defines=defines, vertex="corner.vert", folder=folder)
    target = gl.framebuffer([gl.texture((SIDE, SIDE), 4, dtype="f4")])
    target.use()
    gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
    program["deepest"] = deepest
    corners = gl.buffer(np.array([-1, -1, 3, -1, -1, 3], np.float32))
    gl.vertex_array(program, [(corners, "2f", "in_position")]).render(moderngl.TRIANGLES)
    return np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(SIDE, SIDE, 4)


@pytest.mark.parametrize("emissive", [0, 1])
@pytest.mark.parametrize("deepest, shallow", [(1.0, 1), (1.0, 0), (30.0, 0)])
def test_an_interval_is_its_integral(
    context: Context, tmp_path: Path, deepest: float, shallow: int, emissive: int
) -> None:
    found = drawn(context, tmp_path, deepest, {"SHALLOW": shallow, "EMISSIVE": emissive})
    # q is off by 4e-6, or 2.4e-7 for emission, and counts twice at most; b by 2e-6, and counts half: per depth, of
    # which parts of 1 count e^-1 of the one before, 1.6 in all; or per emission. Float32 rounds some ten times in each.
    off = 2 * 2.4e-7 if emissive else 2 * 4e-6 + 0.5 * 2e-6
    exact = expected(deepest, bool(emissive))
    depths = np.minimum(np.linspace(0, deepest, SIDE), 1.6)
    scale = np.maximum(depths, exact[..., :3].sum(axis=2)) if emissive else depths
    limit = scale * (off + 10 * 2.0**-24) + 2.0**-24
    assert (np.abs(found - exact).max(axis=2) <= limit).all()
