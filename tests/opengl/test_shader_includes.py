"""Included shader files are complete by themselves; shader files and their functions are short; each file is used."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.shader_programs import EITHER, LIGHTS, OF_A_VOLUME, VERTEX
from support.shader_switches import rows

from texvol.opengl.contexts import Context
from texvol.opengl.shaders import FOLDER, load_program
from texvol.opengl.uniforms import NO_LIGHT
from texvol.textures.ramps import NUMBERS_OF_RAMPS

Switches = dict[str, int]

WHOLE: Switches = {"HALF_SPACES": 0, "INTERVAL": 0}
VISIBLE: list[Switches] = [{"HALF_SPACES": planes, "INTERVAL": interval} for planes in (0, 1, 7) for interval in EITHER]
EVERY_LIGHT: list[Switches] = [NO_LIGHT | each for each in LIGHTS[1:]]
OF_VALUES: Switches = WHOLE | {"GRADIENT": 1, "WEIGHTS": 0, "BRICKS": 0, "FETCHED": 0}


def product(**choices: tuple[int, ...]) -> list[Switches]:
    """Every combination of the values of switches."""
    return [dict(zip(choices, each, strict=True)) for each in itertools.product(*choices.values())]


def slabs_of(*classifications: int) -> list[Switches]:
    """Switches of the files that draw slabs of some classifications."""
    return [
        each | WHOLE | {"SKIPS": skips, "COUNT": skips}
        for each in OF_A_VOLUME
        for skips in EITHER
        if each["CLASSIFICATION"] in classifications
    ]


OF_A_SURFACE = product(LINES=EITHER, HALF_SPACES=(0, 7), PERSPECTIVE=EITHER, POINT_LIGHTS=(0, 2))
# Switches of each included file; no others are defined when it is compiled.
SWITCHES: dict[str, list[Switches]] = {
    "box_walk.glsl": VISIBLE,
    "best_cells.glsl": [{}],
    "brick.glsl": product(BRICKS=EITHER),
    "classify.glsl": [
        each | {"SHALLOW": each["RAMPS"] // 2, "SPREAD": spread, "FETCHED": each["MISSING"]}
        for each in product(RAMPS=(0, 2), EMISSIVE=EITHER, MISSING=EITHER)
        for spread in EITHER
    ],
    "compositing.glsl": product(SHALLOW=EITHER, COUNT=EITHER),
    "divided_slabs.glsl": [each | {"AT_ONCE": 2, "DIVIDES": 1, "WHOLE_SLABS": 0} for each in slabs_of(2)],
    "each_ramp.glsl": product(RAMPS=NUMBERS_OF_RAMPS),
    "corner_values.glsl": [OF_VALUES | each for each in product(MISSING=EITHER)],
    "end_slabs.glsl": [
        each | {"AT_ONCE": 2, "DIVIDES": 0, "WHOLE_SLABS": 0, "CAPS": caps}
        for each in slabs_of(0, 1, 2, 3)
        for caps in EITHER
    ],
    "extreme_value.glsl": [OF_VALUES | each for each in product(MISSING=EITHER, SKIPS=EITHER, KNOWN=EITHER)],
    "graded.glsl": product(MODULATIONS=(0, 2), GRADED=(0, 2), CONTOURS=(0, 2)),
    "half_spaces.glsl": product(HALF_SPACES=(0, 1, 7)),
    "integrate.glsl": [
        each | {"MISSING": each["SHALLOW"], "SPREAD": 0, "FETCHED": 0}
        for each in product(RAMPS=(0, 2), EMISSIVE=EITHER, SHALLOW=EITHER)
    ],
    "integrated_slabs.glsl": slabs_of(3),
    "interpolated.glsl": product(FETCHED=EITHER),
    "isosurfaces.glsl": [
        OF_VALUES | NO_LIGHT | LIGHTS[1 + lights] | {"DEPTH": 1 - lights, "CUE": lights, "PERSPECTIVE": lights} | each
        for lights in EITHER
        for each in product(MISSING=EITHER, SKIPS=EITHER, ISOVALUES=(1, 8))
    ],
    "isosurface.glsl": [
        OF_VALUES | NO_LIGHT | LIGHTS[1 + lights] | {"DEPTH": 1 - lights, "CUE": lights, "PERSPECTIVE": lights} | each
        for lights in EITHER
        for each in product(MISSING=EITHER, SKIPS=EITHER)
    ],
    "light.glsl": [
        {key: each[key] for key in each if key != "LIT"} | {"FETCHED": fetched}
        for each in EVERY_LIGHT
        for fetched in EITHER
    ],
    "line_integral.glsl": [OF_VALUES | each for each in product(MISSING=(0, 1, 2))],
    "medium.glsl": OF_A_VOLUME,
    "obliquity.glsl": product(PERSPECTIVE=EITHER),
    "optics.glsl": product(SHALLOW=EITHER),
    "pixel_ray.glsl": product(PERSPECTIVE=EITHER),
    "projection.glsl": rows("projection", count=8),
    "sampled_slabs.glsl": [
        each | {"AT_ONCE": at_once, "DIVIDES": 0, "WHOLE_SLABS": at_once // 2 - 1}
        for each in slabs_of(0, 1, 2)
        for at_once in (2, 4)
    ],
    "seen.glsl": [
        each | {"PERSPECTIVE": either, "CUE": either, "FETCHED": either}
        for each in [NO_LIGHT, *EVERY_LIGHT]
        for either in EITHER
    ],
    "several.glsl": rows("several", count=3),
    "skip.glsl": product(BRICKS=EITHER),
    "slab_runs.glsl": [WHOLE | each for each in product(SKIPS=EITHER, CLASSIFICATION=(0, 2, 3), BRICKS=EITHER)],
    "slab_stack.glsl": rows("slab_stack", count=8),
    "stack_walk.glsl": [seen | each for seen in VISIBLE for each in product(PERSPECTIVE=EITHER, BRICKS=EITHER)],
    "surface_color.glsl": [
        each | {"PERSPECTIVE": either, "CUE": either, "FETCHED": 0}
        for each in [NO_LIGHT, *EVERY_LIGHT]
        for either in EITHER
    ],
    "surface_hit.glsl": OF_A_SURFACE,
    "surface_lists.glsl": [each | {"LIT": each["LINES"]} for each in OF_A_SURFACE],
    "surface_table.glsl": product(LIT=EITHER),
    "value_pieces.glsl": [OF_VALUES | each for each in product(MISSING=EITHER)],
    "visible.glsl": VISIBLE,
    "volume_texture.glsl": product(BRICKS=EITHER, GRADIENT=(0, 1, 2), WEIGHTS=EITHER, MISSING=EITHER, FETCHED=EITHER),
    "volume_walk.glsl": [
        each | {"HALF_SPACES": either, "INTERVAL": either, "SKIPS": either, "FACES": either}
        for each in OF_A_VOLUME
        for either in EITHER
        if each["CLASSIFICATION"]
    ],
}
INCLUDES = sorted(file.name for file in FOLDER.glob("*.glsl"))


@pytest.mark.parametrize("include", INCLUDES)
def test_an_include_compiles_with_nothing_of_its_includer(context: Context, tmp_path: Path, include: str) -> None:
    (tmp_path / "alone.vert").write_text(VERTEX)
    for name in INCLUDES:
        (tmp_path / name).write_text((FOLDER / name).read_text())
    (tmp_path / "alone.frag").write_text(
        f'#version 330\n#include "{include}"\nout vec4 c;\nvoid main() {{ c = vec4(0); }}\n'
    )
    for defines in SWITCHES.get(include, [{}]):
        load_program(context.gl, "alone", defines=defines, folder=tmp_path)


def test_every_shader_file_is_reached_from_a_program() -> None:
    stages = {file.stem for end in ("vert", "frag", "comp") for file in FOLDER.glob(f"*.{end}")}
    assert "slab_stack" in stages
    included = set(itertools.chain.from_iterable(
        re.findall(r'#include "([^"]+)"', file.read_text()) for file in FOLDER.iterdir() if file.is_file()
    ))  # fmt: skip
    assert included == set(INCLUDES) == set(INCLUDES) | set(SWITCHES)


def functions(text: str) -> Iterator[tuple[str, int]]:
    """Name and number of lines of each function of a shader file, from its first line to its closing brace."""
    name, first = "", 0
    for number, line in enumerate(text.splitlines()):
        begun = re.match(r"(?!struct\b)\w+ (\w+)\(", line)
        if begun and not line.endswith(";"):
            name, first = begun[1], number
        if line == "}" and name:
            yield name, number + 1 - first
            name = ""


def test_functions_are_found() -> None:
    text = "struct A {\n    float a;\n};\n\nvec4 b(float x,\n    float y) {\n    return c(x);\n}\nvoid main() {\n}\n"
    assert list(functions(text)) == [("b", 4), ("main", 2)]


@pytest.mark.parametrize("file", sorted(FOLDER.iterdir()), ids=lambda file: file.name)
def test_shader_files_and_their_functions_are_short(file: Path) -> None:
    text = file.read_text()
    assert len(text.splitlines()) < 400
    found = dict(functions(text))
    assert found or file.suffix == ".glsl"
    long = {name: lines for name, lines in found.items() if lines >= 40}
    assert not long, f"{file.name}: functions of 40 lines or more: {long}"
