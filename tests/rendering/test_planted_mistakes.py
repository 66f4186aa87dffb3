"""The checks can fail: each of the usual mistakes, planted in the renderer, takes a hard case over its bound.

The same cases are within their bounds without the mistake, see test_hard_cases.
"""

from __future__ import annotations

import pytest
from support import planted
from support.hard_cases.cases import hard_cases
from support.hard_cases.table import run

from texvol.opengl.shaders import ShaderError

CASES = {case.name: case for case in hard_cases()}

MISTAKES = {
    "linear opacity": (planted.LINEAR_OPACITY, "slab thicker than the box"),
    "unclipped end slabs": (planted.UNCLIPPED_END_SLABS, "view along a space diagonal"),
    "back's alpha in over, in registers": (planted.BACKS_ALPHA_IN_REGISTERS, "view along an axis"),
    "back's alpha in over, in the blend": (planted.BACKS_ALPHA_IN_BLEND, "4096 slabs"),
    "half-texel shift": (planted.HALF_TEXEL_SHIFT, "view along an axis"),
    "missing cosine": (planted.MISSING_COSINE, "field of view 150°"),
    "swapped axes": (planted.SWAPPED_AXES, "7×5×3"),
}


@pytest.mark.parametrize("classification", ["slab", "extinction", "post", "integrated"])
@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_planted_mistake_takes_a_hard_case_over_its_bound(mistake: str, classification: str) -> None:
    replacements, name = MISTAKES[mistake]
    with planted.planted(*replacements) as renderer:
        outcome = run(CASES[f"{name}, {classification}"], renderer)
    # Far over: such a mistake is first order, the bounds second order or rounding.
    assert outcome.max_error > 3 * outcome.bound


def test_a_mistake_that_is_no_longer_where_it_was_is_an_error() -> None:
    stale = ("slab_stack.frag", "what nobody writes", "")
    with pytest.raises(ShaderError, match="0 times, and not once"), planted.planted(stale):
        pass


def test_a_renderer_without_replacements_is_the_real_one() -> None:
    case = CASES["view along an axis, extinction"]
    with planted.planted() as renderer:
        assert not run(case, renderer).over


def test_planted_modules_do_not_stay() -> None:
    from texvol.scene import optics
    from texvol.textures import slab_texture

    with planted.planted(*planted.LINEAR_OPACITY):
        assert slab_texture.optics is not optics
    assert slab_texture.optics is optics
