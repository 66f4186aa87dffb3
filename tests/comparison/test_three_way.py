"""Which of two pictures is nearer to the truth: both numbers of the error count, chance and rounding don't."""

from __future__ import annotations

import numpy as np
import pytest
from support.scenes import BONE, FOG, random_volume

import texvol
from texvol.comparison.common_form import CommonForm
from texvol.comparison.three_way import MAX_CHANGE, RMS_CHANGE, ROUNDING, three_way
from texvol.provenance.stored_scene import StoredScene
from texvol.rendering.renderer import Renderer
from texvol.scene.display import shown
from texvol.scene.scene import Scene
from texvol.util.errors import InputError

SHAPE = (20, 24, 4)
TRUTH = np.random.default_rng(0).random(SHAPE)
NOISE = np.random.default_rng(1).standard_normal(SHAPE)


def verdict(candidate: np.ndarray, reference: np.ndarray, truth: np.ndarray = TRUTH, **options: bool) -> str:
    found = three_way(candidate, reference, truth, **options)
    title = {"better": "changed for the better", "worse": "changed for the worse", "sideways": "changed sideways"}
    assert found.words.startswith(title[found.verdict])
    return found.verdict


def one_pixel(picture: np.ndarray, by: float) -> np.ndarray:
    """The picture with one channel of one pixel off."""
    changed = picture.copy()
    changed[7, 9, 1] += by
    return changed


def test_less_of_the_same_error_is_better_and_more_is_worse() -> None:
    near, far = TRUTH + 1e-3 * NOISE, TRUTH + 2e-3 * NOISE
    assert (verdict(near, far), verdict(far, near), verdict(near, near)) == ("better", "worse", "sideways")


@pytest.mark.parametrize(("change", "found"), [(0.9, "sideways"), (1.1, "worse")])
def test_a_change_of_rms_counts_from_its_margin_on(change: float, found: str) -> None:
    # Of an error that grows by x all of itself, rms grows by x / (1 + x) of the larger; max by less than its margin.
    grown = change * RMS_CHANGE / (1 - change * RMS_CHANGE)
    assert verdict(TRUTH + 1e-3 * (1 + grown) * NOISE, TRUTH + 1e-3 * NOISE) == found


@pytest.mark.parametrize(("change", "found"), [(0.9, "sideways"), (1.1, "worse")])
def test_a_change_of_the_worst_pixel_counts_from_its_margin_on(change: float, found: str) -> None:
    # One number of 1920 that is 4 times as large as the others: rms changes by less than 1 % of itself.
    level = 1e-3 * np.ones(SHAPE)
    before, after = one_pixel(level, 3e-3), one_pixel(level, 4e-3 / (1 - change * MAX_CHANGE) - 1e-3)
    assert verdict(TRUTH + after, TRUTH + before) == found


def test_what_float32_rounds_away_is_no_change() -> None:
    assert verdict(TRUTH + 0.9 * ROUNDING, TRUTH) == "sideways"
    assert verdict(TRUTH + 1.1 * ROUNDING, TRUTH) == "worse"
    # Of brighter pictures it is more.
    assert verdict(100 * TRUTH + 1.1 * ROUNDING, 100 * TRUTH, 100 * TRUTH) == "sideways"


def test_rms_and_the_worst_pixel_that_contradict_each_other_are_sideways_and_it_is_said() -> None:
    blurred, spotted = TRUTH + 1e-3 * NOISE, one_pixel(TRUTH + 1e-4 * NOISE, 0.02)
    found = three_way(spotted, blurred, TRUTH)
    assert found.verdict == "sideways"
    assert "nearer rms and farther in its worst pixel" in found.words
    found = three_way(blurred, spotted, TRUTH)
    assert found.verdict == "sideways"
    assert "nearer in its worst pixel and farther rms" in found.words


def test_one_wrong_pixel_among_many_is_worse_whatever_rms_says() -> None:
    before = TRUTH + 0.01 * NOISE
    after = one_pixel(before, 0.1)
    assert np.sqrt(np.square(after - TRUTH).mean()) < 1.05 * np.sqrt(np.square(before - TRUTH).mean())
    assert (verdict(after, before), verdict(before, after)) == ("worse", "better")


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_worse(wrong: float) -> None:
    broken, off = one_pixel(TRUTH, wrong), TRUTH + 1
    assert verdict(broken, off) == "worse"
    assert verdict(broken, broken) == "worse"
    assert verdict(off, broken) == "better"
    assert "the candidate is not finite in 1 pixels" in three_way(broken, off, TRUTH).words


def test_infinite_numbers_that_are_the_truth_are_no_error() -> None:
    truth = one_pixel(TRUTH, np.inf)
    assert three_way(truth, truth, truth).candidate_error.max_error == 0
    assert verdict(truth, TRUTH, truth) == "better"  # the reference is finite there, and wrong


def test_opacity_counts_only_where_there_is_one() -> None:
    opaque = TRUTH.copy()
    opaque[..., 3] = 1
    assert verdict(opaque, TRUTH) == "worse"
    assert verdict(opaque, TRUTH, has_opacity=False) == "sideways"


def test_words_have_the_numbers() -> None:
    found = three_way(TRUTH + 1.2e-4, TRUTH + 3.4e-3, TRUTH)
    numbers = "rms 0.00012 from the oracle, the reference 0.0034; at most 0.00012, the reference 0.0034"
    assert found.words == f"changed for the better: {numbers}"
    assert found.candidate_error.rms_error == pytest.approx(1.2e-4)
    assert found.reference_error.max_error == pytest.approx(3.4e-3)


def test_pictures_of_other_sizes_are_refused() -> None:
    with pytest.raises(InputError, match="one shape"):
        three_way(TRUTH, TRUTH, TRUTH[1:])


# With the oracle.

SIZE = (24, 20)


@pytest.mark.parametrize("classification", ["slab", "extinction", "post", "integrated"])
def test_thinner_slabs_are_for_the_better(classification: str, renderer: Renderer) -> None:
    scene = Scene(random_volume(3), FOG, classification=classification)  # type: ignore[arg-type]
    coarse, fine = (renderer.render(scene, SIZE, slab_thickness=each) for each in (1.0, 0.25))
    truth = texvol.raycast(scene, SIZE)
    assert (verdict(fine, coarse, truth), verdict(coarse, fine, truth)) == ("better", "worse")


def test_the_truth_of_eight_bits_is_what_they_can_hold() -> None:
    bright = Scene(random_volume(3), BONE, background=(3.0, 0.5, 0), classification="slab")
    stored, truth = StoredScene(bright), texvol.raycast(bright, SIZE)
    assert truth.max() > 1
    for ends_at_one, expected in ((False, truth), (True, np.clip(truth, 0, 1))):
        form = CommonForm(ends_at_one, has_opacity=True)
        np.testing.assert_array_equal(form.of_truth(truth, stored), expected)
    assert (CommonForm(False, has_opacity=False).of_truth(truth, stored)[..., 3] == 1).all()


def test_the_truth_of_numbers_in_eight_bits_is_grey_in_the_window() -> None:
    scene = Scene(random_volume(3), mode="average", classification="slab")
    stored = StoredScene(scene, window=(0.5, 0.25))
    truth = texvol.raycast(scene, SIZE)
    expected = shown(truth, scene, window=(0.5, 0.25))
    np.testing.assert_array_equal(CommonForm(ends_at_one=True, has_opacity=True).of_truth(truth, stored), expected)
    assert np.unique(expected[..., 0]).size > 20  # and it is no flat picture
