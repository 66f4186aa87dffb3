"""The slab integral against its limits, and the shader's version of it against Python's."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from texvol.opengl.contexts import Context
from texvol.opengl.shaders import FOLDER
from texvol.scene import optics

DEPTHS = [0.0, 1e-30, 1e-12, 1e-8, 1e-3, 0.3, 0.4999, 0.5, 1.0, 5.0, 50.0, 1e4]


@pytest.mark.parametrize("depth", DEPTHS)
def test_a_slab_of_constant_matter_is_its_closed_form(depth: float) -> None:
    color, opacity = optics.slab_integral(np.array([0.7, 0.2, 0.0]), depth, 1.0)
    # In long double 1 - e^-x has 19 digits; below 1e-6 its Taylor series has more.
    x = np.longdouble(depth)
    expected = x * (1 - x / 2 + x * x / 6) if depth < 1e-6 else 1 - np.exp(-x)
    assert opacity == pytest.approx(float(expected), rel=1e-13)
    mean = float(expected / x) if depth > 0 else 1.0
    np.testing.assert_allclose(color, np.array([0.7, 0.2, 0.0]) * mean, rtol=1e-13)


def test_infinite_extinction_is_opaque_and_shows_its_color() -> None:
    color, opacity = optics.slab_integral(np.array([0.7, 0.2, 0.0]), np.inf, 1e-9)
    assert opacity == 1.0
    np.testing.assert_array_equal(color, [0.7, 0.2, 0.0])


@given(
    st.lists(st.tuples(*[st.floats(0, 1)] * 4), min_size=3, max_size=3),
)
def test_over_is_associative(slabs: list[tuple[float, float, float, float]]) -> None:
    a, b, c = (np.array(slab) for slab in slabs)
    # Two roundings of numbers up to 3: 4 ulp.
    np.testing.assert_allclose(optics.over(optics.over(a, b), c), optics.over(a, optics.over(b, c)), atol=2e-15)


@given(st.floats(1e-6, 20), st.floats(0.01, 0.99))
def test_a_slab_is_its_parts_composited(depth: float, fraction: float) -> None:
    def slab(part: float) -> np.ndarray:
        color, opacity = optics.slab_integral(np.array([0.7, 0.2, 0.1]) * depth, depth, part)
        return np.append(color, opacity)

    np.testing.assert_allclose(optics.over(slab(fraction), slab(1 - fraction)), slab(1.0), rtol=1e-12)


@pytest.mark.parametrize("deepest", [60.0, 2.0])
def test_the_shader_computes_what_python_does(context: Context, deepest: float) -> None:
    x = np.concatenate([DEPTHS, np.geomspace(1e-12, deepest, 500)]).astype(np.float32)
    x = x[x <= deepest]
    opacity = optics.opacity_from_depth(x).astype(np.float32)
    source = f"""#version 330
        #define SHALLOW {int(optics.is_shallow(deepest))}
        {(FOLDER / "optics.glsl").read_text("utf-8")}
        in float depth; in float opacity;
        out float out_opacity; out float out_depth; out float out_mean; out float out_per_opacity; out vec4 out_over;
        void main() {{
            out_opacity = opacity_from_depth(depth);
            out_depth = depth_from_opacity(opacity);
            out_mean = mean_transmittance(depth, out_opacity);
            out_per_opacity = depth_per_opacity(opacity);
            out_over = over(vec4(0.1, 0.2, 0.3, opacity), vec4(0.3, 0.2, 0.1, 0.5));
        }}"""
    names = ["out_opacity", "out_depth", "out_mean", "out_per_opacity", "out_over"]
    gl = context.gl
    program = gl.program(vertex_shader=source, varyings=names)
    inputs = gl.buffer(np.stack([x, opacity], axis=1).astype(np.float32))
    outputs = gl.buffer(reserve=x.size * 8 * 4)
    array = gl.vertex_array(program, [(inputs, "1f 1f", "depth", "opacity")])
    array.transform(outputs, moderngl.POINTS)
    result = np.frombuffer(outputs.read(), np.float32).reshape(-1, 8).astype(np.float64)
    # Five roundings of 2^-24 each, and exp and log good to 4 ulp where they are called.
    np.testing.assert_allclose(result[:, 0], optics.opacity_from_depth(x), rtol=6e-7)
    visible = (x > 0) & (opacity < 1)
    np.testing.assert_allclose(result[visible, 1], optics.depth_from_opacity(opacity[visible]), rtol=6e-7)
    assert (result[opacity == 1, 1] > 1e20).all()
    np.testing.assert_allclose(result[:, 2], optics.mean_transmittance(x), rtol=6e-7)
    shallow = visible & (opacity < 0.8873)
    # The function is 5e-7 off, and float32 rounds six times.
    expected = optics.depth_from_opacity(opacity[shallow]) / opacity[shallow]
    np.testing.assert_allclose(result[shallow, 3], expected, rtol=8e-7)
    back = np.array([0.3, 0.2, 0.1, 0.5])
    front = np.stack([np.full(x.size, part) for part in (0.1, 0.2, 0.3)] + [opacity.astype(float)], axis=1)
    np.testing.assert_allclose(result[:, 4:], optics.over(front, back), atol=2e-7)
