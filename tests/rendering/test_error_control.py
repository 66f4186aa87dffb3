"""The thickness that is chosen for a wanted error: on pictures of known error, and on random scenes."""

from __future__ import annotations

import numpy as np
import pytest
from support.error_control import SIZE, outcomes, random_scene

from texvol.rendering.error_control import SAFETY, Begin, Choice, estimate, thickness_for_error
from texvol.rendering.renderer import Renderer


def choose(order: float, wanted: float, error_at_one: float) -> tuple[Choice, list[float]]:
    """Choice among pictures whose error is `error_at_one` at one slab per spacing and falls with `order`."""
    drawn: list[float] = []

    def draw(thickness: float) -> np.ndarray:
        drawn.append(thickness)
        return np.full((2, 2, 4), 0.5 + error_at_one * (thickness / 3.0) ** order)

    return thickness_for_error(draw, draw, 3.0, wanted), drawn


@pytest.mark.parametrize("order", [1, 1.5, 2])
@pytest.mark.parametrize("wanted", [1e-1, 1e-2, 2e-3])
def test_the_choice_is_within_the_wanted_error_and_not_much_finer(order: float, wanted: float) -> None:
    choice, _ = choose(order, wanted, 0.02)
    true = 0.02 * (choice.slab_thickness / 3.0) ** order
    assert choice.reached
    assert true <= choice.estimated_error <= wanted
    # Two halvings coarser would be over it: the safety of 1.5, up to 2 for an order above 1, and 2 for halving.
    assert true * 4**order > wanted or choice.slab_thickness == 48.0


def test_what_cannot_be_reached_is_said() -> None:
    choice, drawn = choose(0.0, 1e-3, 0.02)
    assert choice.reached  # nothing changes with the thickness: there is no error
    choice, drawn = choose(0.5, 1e-5, 0.02)
    assert not choice.reached
    assert choice.estimated_error > 1e-5
    assert min(drawn) >= 3.0 / 128


def test_fine_slabs_are_found_in_a_few_steps() -> None:
    for order in (1.0, 2.0):
        choice, drawn = choose(order, 4e-4, 0.5)
        true = 0.5 * (choice.slab_thickness / 3.0) ** order
        assert choice.reached == (order == 2) and len(drawn) <= 8, "two for each step, and no step of a single halving"
        assert true * 4**order > 4e-4


def test_coarser_slabs_are_tried_when_coarse_ones_will_do() -> None:
    choice, drawn = choose(2, 1e-1, 1e-4)
    assert choice.slab_thickness == 48.0
    assert len(drawn) == 6  # 1 and 2 slabs per spacing, and ½ … 1/16


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("reference_off", [0.0, 1e-3, 1e-2])
@pytest.mark.parametrize("wanted", [3e-2, 1e-3])
def test_a_reference_that_converges_by_itself(order: int, reference_off: float, wanted: float) -> None:
    """The picture's error is known whatever the reference's is, and hardly finer slabs are drawn than that takes."""
    references: list[float] = []

    def draw(thickness: float) -> np.ndarray:
        return np.full((2, 2, 4), 0.5 + 0.02 * (thickness / 3.0) ** order)

    def draw_reference(thickness: float) -> np.ndarray:
        references.append(thickness)
        return np.full((2, 2, 4), 0.5 - reference_off * thickness / 3.0)

    choice = thickness_for_error(draw, draw_reference, 3.0, wanted, converges_alone=True)
    true = 0.02 * (choice.slab_thickness / 3.0) ** order
    assert choice.reached and true <= choice.estimated_error <= wanted
    # Half of what is wanted may go to the reference, which costs a halving at order 1.
    assert true * 4**order > wanted or choice.slab_thickness == 48.0
    finest = min(references)
    enough = SAFETY * reference_off * 4 * finest / 3.0 <= wanted / 2  # one of four times this thickness
    assert finest == 1.5 or not enough, "at most one halving finer than it has to be"


def test_a_search_begins_where_another_ended() -> None:
    def search(begin: Begin | None) -> tuple[Choice, list[float]]:
        drawn: list[float] = []

        def draw(thickness: float) -> np.ndarray:
            drawn.append(thickness)
            return np.full((2, 2, 4), 0.5 + 0.02 * (thickness / 3.0) ** 2)

        return thickness_for_error(draw, draw, 3.0, 1e-4, begin), drawn

    (first, all_drawn), (second, few_drawn) = search(None), search(search(None)[0].begin)
    assert first.slab_thickness == second.slab_thickness and len(few_drawn) < len(all_drawn)


def test_an_estimate_is_an_upper_bound_at_first_order() -> None:
    exact = np.zeros((1, 1, 4), np.float32)
    for halvings in (1, 2, 3):
        coarse, fine = exact + 0.1, exact + 0.1 / 2**halvings
        assert estimate(coarse, fine, halvings) == pytest.approx(SAFETY * 0.1, rel=1e-4)


def test_random_scenes_keep_the_error_that_was_asked_for() -> None:
    """A few of those that scripts/error_control.py draws; there 99 in a hundred keep it."""
    random, wanted = np.random.default_rng(11), (3e-2, 3e-3)
    with Renderer() as renderer:
        found = [each for _ in range(8) for each in outcomes(renderer, random_scene(random, []), SIZE, wanted)]
    asked = wanted * 8
    assert all(each.true <= limit or not each.reached for each, limit in zip(found, asked, strict=True))
    assert np.mean([each.finer <= 2 for each in found]) >= 0.9
