"""The checks can fail: each of the usual mistakes, planted in the renderer, takes a hard case over its bound.

The same cases are within their bounds without the mistake, see test_hard_cases.
"""

from __future__ import annotations

import pytest
from support import planted
from support.hard_cases.cases import hard_cases
from support.hard_cases.table import run

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


# Each mistake in texels of a medium and in texels of values.
KINDS = [("slab", "post"), ("extinction", "integrated")]
PLANTED = [(mistake, kind) for number, mistake in enumerate(MISTAKES) for kind in KINDS[number % 2]]


@pytest.mark.parametrize("mistake, classification", PLANTED)
def test_a_planted_mistake_takes_a_hard_case_over_its_bound(mistake: str, classification: str) -> None:
    mistakes, name = MISTAKES[mistake]
    with planted.planted(*mistakes) as renderer:
        outcome = run(CASES[f"{name}, {classification}"], renderer)
    # Far over: such a mistake is first order, the bounds second order or rounding.
    assert outcome.max_error > 3 * outcome.bound


def test_a_mistake_in_an_attribute_that_is_no_longer_there_is_an_error() -> None:
    stale = planted.Attribute("texvol.scene.optics.what_nobody_wrote", None)
    with pytest.raises(AttributeError, match="what_nobody_wrote"), planted.planted(stale):
        pass


def test_a_renderer_without_mistakes_is_the_real_one() -> None:
    case = CASES["view along an axis, extinction"]
    with planted.planted() as renderer:
        assert not run(case, renderer).over


def test_planted_attributes_do_not_stay() -> None:
    from texvol.scene import optics

    right = optics.opacity_from_depth
    with planted.planted(*planted.LINEAR_OPACITY):
        assert optics.opacity_from_depth is not right
    assert optics.opacity_from_depth is right
