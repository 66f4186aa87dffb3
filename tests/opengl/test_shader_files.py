"""Shader files become programs, and whatever is missing or wrong is named with its file and line."""

from __future__ import annotations

import re
import signal
from pathlib import Path
from typing import Any

import pytest
from support.shader_programs import VERTEX, one_pixel

from texvol.opengl.contexts import Context
from texvol.opengl.shaders import ShaderError, _with_files, load_program, set_uniforms

FRAGMENT = """#version 330
#include "half.glsl"
#include "twice.glsl"
uniform float brightness;
uniform float unused;
out vec4 color;
void main() {
    color = vec4(twice(half_of(brightness)));
}
"""
HALF = "float half_of(float x) { return x / 2.0; }\n"
TWICE = '#include "half.glsl"\nfloat twice(float x) { return 4.0 * half_of(x); }\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Shader files of one program, `plain`."""
    files = {"plain.vert": VERTEX, "plain.frag": FRAGMENT, "half.glsl": HALF, "twice.glsl": TWICE}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_an_include_is_put_in_its_place_once(context: Context, folder: Path) -> None:
    program = load_program(context.gl, "plain", folder=folder)  # half.glsl twice would be a redefinition
    set_uniforms(program, {"brightness": 0.75})
    assert one_pixel(context, program) == 0.75


def test_a_switch_is_defined_with_its_value(context: Context, folder: Path) -> None:
    (folder / "plain.frag").write_text(
        "#version 330\nout vec4 c;\n#if LEVEL > 2\nvoid main() { c = vec4(LEVEL); }\n#endif\n"
    )
    assert one_pixel(context, load_program(context.gl, "plain", defines={"LEVEL": 3}, folder=folder)) == 3.0


def test_an_unknown_switch_is_an_error(context: Context, folder: Path) -> None:
    mentioned = "// SHINY is mentioned in a comment\nconst float SHINY_ONE = 1.0, NOT_SHINY = 0.0;\n"
    (folder / "plain.frag").write_text(FRAGMENT + mentioned)
    with pytest.raises(ShaderError, match=r"^plain\.vert and plain\.frag have no switch SHINY$"):
        load_program(context.gl, "plain", defines={"SHINY": 1}, folder=folder)


@pytest.mark.parametrize("condition", ["#if SHINY", "#ifdef SHINY", "#if defined(SHINY) && 1", "#if 0\n#elif SHINY"])
def test_a_switch_without_a_value_is_an_error(context: Context, folder: Path, condition: str) -> None:
    (folder / "plain.frag").write_text(f"{FRAGMENT}{condition}\n#endif\n")
    with pytest.raises(ShaderError, match=r"need a value for SHINY$"):
        load_program(context.gl, "plain", folder=folder)


def test_a_macro_that_the_file_defines_itself_is_no_switch(context: Context, folder: Path) -> None:
    (folder / "plain.frag").write_text(
        FRAGMENT + "#define OWN 1\n#if OWN && __VERSION__ >= 330 && !defined GL_ES\n#endif\n"
    )
    load_program(context.gl, "plain", folder=folder)


@pytest.mark.parametrize(
    ("file", "text", "position"),
    [
        ("plain.vert", VERTEX + "wrong;\n", "plain.vert:5: "),
        ("plain.frag", FRAGMENT + "wrong;\n", "plain.frag:10: "),
        ("plain.frag", FRAGMENT.replace("half_of(b", "wrong(b"), "plain.frag:8: "),
        ("half.glsl", HALF + "\nwrong;\n", "half.glsl:3: "),
        ("twice.glsl", TWICE + "wrong;\n", "twice.glsl:3: "),
    ],
)
def test_a_compile_error_names_file_and_line(
    context: Context, folder: Path, file: str, text: str, position: str
) -> None:
    (folder / file).write_text(text)
    with pytest.raises(ShaderError, match=rf"(?m)^{re.escape(position)}"):
        load_program(context.gl, "plain", defines={}, folder=folder)


def test_lines_are_counted_from_the_file_also_below_switches(context: Context, folder: Path) -> None:
    (folder / "plain.frag").write_text("#version 330\n#if A + B\n#endif\nwrong;\n")
    with pytest.raises(ShaderError, match=r"(?m)^plain\.frag:4: "):
        load_program(context.gl, "plain", defines={"A": 1, "B": 2}, folder=folder)


@pytest.mark.parametrize(
    "message",
    [
        "0:20012(3): error: `x' undeclared",  # Mesa
        "0(20012) : error C1503: undefined variable",  # NVIDIA
        "ERROR: 0:20012: 'x' : undeclared identifier",  # AMD, Intel, Apple
    ],
)
def test_the_messages_of_each_vendor_are_understood(message: str) -> None:
    assert _with_files(message, ["slab.vert", "slab.frag"]).startswith("slab.frag:12: ")
    assert _with_files(message, ["slab.vert"]) == message


def test_a_link_error_names_both_files(context: Context, folder: Path) -> None:
    (folder / "plain.frag").write_text(
        "#version 330\nfloat elsewhere();\nout vec4 c;\nvoid main() { c = vec4(elsewhere()); }\n"
    )
    with pytest.raises(ShaderError, match=r"plain\.vert and plain\.frag"):
        load_program(context.gl, "plain", folder=folder)


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("plain.frag", '#version 330\n\n#include "lost.glsl"\n', r"plain\.frag:3: lost\.glsl is not in "),
        ("twice.glsl", '#include "lost.glsl"\n', r"twice\.glsl:1: lost\.glsl is not in "),
        ("plain.frag", "void main() {}\n", r"plain\.frag has no #version line"),
    ],
)
def test_a_missing_part_is_named(context: Context, folder: Path, file: str, text: str, message: str) -> None:
    (folder / file).write_text(text)
    with pytest.raises(ShaderError, match=message):
        load_program(context.gl, "plain", folder=folder)


def test_a_missing_file_is_named(context: Context, folder: Path) -> None:
    with pytest.raises(ShaderError, match=r"other\.vert cannot be read: No such file"):
        load_program(context.gl, "other", folder=folder)


def test_stages_may_come_from_other_files(context: Context, folder: Path) -> None:
    (folder / "plain.vert").rename(folder / "shared.vert")
    load_program(context.gl, "plain", vertex="shared.vert", folder=folder)


@pytest.mark.parametrize("name", ["unused", "brightnes", "corner"])  # dropped by the linker, misspelled, not a uniform
def test_a_uniform_that_the_program_lacks_is_an_error(context: Context, folder: Path, name: str) -> None:
    program = load_program(context.gl, "plain", folder=folder)
    with pytest.raises(ShaderError, match=f"no uniform {name}; it has brightness$"):
        set_uniforms(program, {"brightness": 1.0, name: 1.0})


def test_a_uniform_of_another_shape_is_named(context: Context, folder: Path) -> None:
    program = load_program(context.gl, "plain", folder=folder)
    with pytest.raises(ShaderError, match=r"uniform brightness cannot be \(1, 2\)"):
        set_uniforms(program, {"brightness": (1, 2)})


class Interrupted:
    """A context in whose `program` ctrl-C is pressed; `finished` says that it went on to its end."""

    def __init__(self, context: Context) -> None:
        self._gl = context.gl
        self.info = context.gl.info
        self.finished = False

    def program(self, **sources: str) -> object:
        signal.raise_signal(signal.SIGINT)
        program = self._gl.program(**sources)
        self.finished = True
        return program


def test_ctrl_c_waits_for_the_end_of_a_compilation(context: Context, folder: Path) -> None:
    """moderngl calls Python back while it makes a program; an exception there ends the process."""
    gl: Any = Interrupted(context)
    with pytest.raises(KeyboardInterrupt):
        load_program(gl, "plain", folder=folder)
    assert gl.finished
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
