"""Lines of shader files that stand several times, and flat uniforms."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from support.shader_programs import VERTEX, one_pixel

from texvol.opengl.contexts import Context
from texvol.opengl.shaders import ShaderError, load_program, set_uniforms


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder for the shader files of one program, `plain`."""
    (tmp_path / "plain.vert").write_text(VERTEX)
    return tmp_path


EACH = """#version 330
#each TIMES
#include "own.glsl"
#end
uniform float brightness;
out vec4 color;
void main() {
    float red = brightness;
#each TIMES
    float more_@ = share * @.0 + LEVEL;
    red += own(more_@) + shared.x;
#end
    color = vec4(red);
}
"""
OWN = """#if LEVEL > 1
struct Pair { float share; };
#endif
uniform float share;
uniform vec2 shared_0;
const vec2 shared = vec2(0.25);
float own(float x) { return x + share; }
"""


def test_lines_for_each_stand_as_often_as_the_switch_says(context: Context, folder: Path) -> None:
    (folder / "plain.frag").write_text(EACH)
    (folder / "own.glsl").write_text(OWN)
    program = load_program(
        context.gl, "plain", defines={"TIMES": 3, "LEVEL_0": 1, "LEVEL_1": 2, "LEVEL_2": 3}, folder=folder
    )
    fractions = {"share_0": 0.5, "share_1": 0.25, "share_2": 0.125}
    set_uniforms(program, {"brightness": 0.0} | fractions)
    expected = sum(
        fraction * number + (number + 1) + fraction + 0.25 for number, fraction in enumerate(fractions.values())
    )
    assert one_pixel(context, program) == expected
    [zero] = [load_program(context.gl, "plain", defines={"TIMES": 0}, folder=folder)]
    set_uniforms(zero, {"brightness": 0.75})
    assert one_pixel(context, zero) == 0.75


def test_a_compile_error_in_lines_for_each_names_file_and_line(context: Context, folder: Path) -> None:
    defines = {"TIMES": 2, "LEVEL_0": 1, "LEVEL_1": 2}
    (folder / "own.glsl").write_text(OWN)
    for text, position in (
        (EACH.replace("share * @.0", "wrong"), "plain.frag:10: "),
        (EACH + "wrong;\n", "plain.frag:15: "),
    ):
        (folder / "plain.frag").write_text(text)
        with pytest.raises(ShaderError, match=rf"(?m)^{re.escape(position)}"):
            load_program(context.gl, "plain", defines=defines, folder=folder)
    (folder / "plain.frag").write_text(EACH)
    (folder / "own.glsl").write_text(OWN + "\nwrong;\n")
    with pytest.raises(ShaderError, match=r"(?m)^own\.glsl:9: "):
        load_program(context.gl, "plain", defines=defines, folder=folder)
    with pytest.raises(ShaderError, match=r"^plain\.frag:2: TIMES needs a value$"):
        load_program(context.gl, "plain", folder=folder)


@pytest.mark.parametrize("room", [120, 10**6])
def test_a_flat_uniform_comes_through_the_vertex_shader(
    context: Context, folder: Path, monkeypatch: pytest.MonkeyPatch, room: int
) -> None:
    monkeypatch.setattr("texvol.opengl.shaders._ROOM", room)
    (folder / "plain.frag").write_text("""#version 330
#define MORE LEVEL > 1
#if MORE
flat uniform vec2 more[LEVEL];  // a comment
#else
flat uniform float less;
#endif
out vec4 color;
void main() {
#if MORE
    color = vec4(more[LEVEL - 1].y);
#else
    color = vec4(less);
#endif
}
""")
    less = load_program(context.gl, "plain", defines={"LEVEL": 1}, folder=folder)
    set_uniforms(less, {"less": 0.25})
    assert one_pixel(context, less) == 0.25
    assert ("less" in less) == (room > 120)
    more = load_program(context.gl, "plain", defines={"LEVEL": 2}, folder=folder)
    set_uniforms(more, {"more": [(0.0, 0.0), (0.0, 0.75)]})
    assert one_pixel(context, more) == 0.75
    with pytest.raises(ShaderError, match="no uniform less; it has more$"):
        set_uniforms(more, {"less": 1.0})
    (folder / "plain.vert").write_text(VERTEX + "wrong;\n")
    with pytest.raises(ShaderError, match=r"(?m)^plain\.vert:5: "):
        load_program(context.gl, "plain", defines={"LEVEL": 1}, folder=folder)
