"""Programs compile with all values of switches that meet: every three of them, or every two of several volumes."""

from __future__ import annotations

import itertools
import re

import pytest
from support.covering import covering
from support.shader_programs import load
from support.shader_switches import rows

from texvol.opengl.contexts import Context
from texvol.opengl.shaders import load_compute
from texvol.textures.ramps import NUMBERS_OF_RAMPS

PROGRAMS = "slab_stack", "slab_ends", "slab_polygon", "projection", "shadow", "several"


@pytest.mark.parametrize("strength", [1, 2, 3])
def test_every_few_values_that_meet_do_so_in_a_row(strength: int) -> None:
    blocks = [
        {"A": (0, 1, 2), "B": (0, 1), "C": (0, 1), "D": (0,), "E": (0, 1)},
        {"A": (3,), "B": (0, 1), "C": (0,), "D": (0, 1), "E": (0, 1)},
    ]
    all_rows = [
        dict(zip(block, values, strict=True)) for block in blocks for values in itertools.product(*block.values())
    ]
    found = [*covering(blocks, strength)]
    assert all(row in all_rows for row in found)
    meeting, covered = (
        {each for row in some for each in itertools.combinations(sorted(row.items()), strength)}
        for some in (all_rows, found)
    )
    assert covered == meeting
    assert len(found) <= len(all_rows) * (0.3, 0.6, 0.9)[strength - 1]


@pytest.mark.parametrize("program", PROGRAMS)
def test_switches_that_meet_compile_together(context: Context, program: str) -> None:
    for row in rows(program):
        load(program, context, row)


@pytest.mark.parametrize("program", ["slab_stack", "projection", "several"])
def test_compute_shaders_compile_with_every_value_of_a_switch(context: Context, program: str) -> None:
    for number, row in enumerate(rows(program, strength=1)):
        named = {"DRAWN": f"{program}.glsl"}
        load_compute(context.gl, "rays", named=named, defines=row | {"TARGET": number % 3, "BLENDING": number % 3})
        context.gl.gc()


def test_every_number_of_ramps_is_compiled() -> None:
    assert {row["RAMPS"] for row in rows("slab_stack")} == {0, *NUMBERS_OF_RAMPS}


@pytest.mark.parametrize("volumes", [1, 3])
def test_volumes_with_labels_or_more_than_two_compile(context: Context, volumes: int) -> None:
    """The third volume has the switches of the second one."""
    for row in rows("several")[:4]:
        own = {name: value for name, value in row.items() if not name.endswith("_1") or volumes > 1}
        third = {re.sub("_1$", "_2", name): value for name, value in row.items() if name.endswith("_1")}
        halves = max(value == 3 for name, value in own.items() if name.startswith("CLASSIFICATION"))
        defines = own | {"VOLUMES": volumes, "HALVES": int(halves)}
        load("several", context, defines | third if volumes == 3 else defines)
