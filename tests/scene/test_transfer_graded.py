"""Matter that depends on the gradient: graded points, contours, modulation, and where any of it may show."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from texvol.scene import transfer
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Contour, Graded
from texvol.util.errors import InputError

WHITE = (1.0, 1.0, 1.0)


def ramp(start: float = 2.0, full: float = 6.0) -> Graded:
    """A trapezium between values 1 and 4."""
    emissions = np.outer([0, 2, 2, 0], (1.0, 0.5, 0.25))
    return Graded(np.array([1.0, 2, 3, 4]), emissions, np.array([0.0, 3, 3, 0]), start, full)


def test_graded_matter_is_its_points_times_a_ramp() -> None:
    random = np.random.default_rng(1)
    values, magnitudes = random.uniform(0, 5, 1000), random.uniform(0, 8, 1000)
    emission, extinction = ramp().at(values, magnitudes)
    shape = np.minimum(np.clip(values - 1, 0, 1), np.clip(4 - values, 0, 1))
    weight = np.clip((magnitudes - 2) / 4, 0, 1)
    np.testing.assert_allclose(extinction, 3 * shape * weight, atol=1e-14)
    np.testing.assert_allclose(emission, np.outer(shape * weight, (2, 1, 0.5)), atol=1e-14)


def test_graded_matter_is_nothing_beyond_its_points() -> None:
    block = Graded(np.array([1.0, 2]), np.full((2, 3), 0.5), np.array([1.0, 1]), 0, 0)
    beyond = [np.nextafter(1, 0), 1, 2, np.nextafter(2, 3), -np.inf, np.inf, np.nan]
    np.testing.assert_array_equal(block.at(beyond, 0)[1], [0, 1, 1, 0, 0, 0, 0])
    np.testing.assert_array_equal(block.weights(beyond, 0), [0, 1, 1, 0, 0, 0, 0])


def test_equal_magnitudes_make_a_step_that_is_there_from_its_place_on() -> None:
    np.testing.assert_array_equal(ramp(5, 5).weights(2.5, [0, np.nextafter(5, 0), 5, 9, np.nan]), [0, 0, 1, 1, 0])
    np.testing.assert_array_equal(ramp(0, 0).weights(2.5, [0, np.nan]), [1, 1])


def test_the_right_side_of_a_graded_step_holds() -> None:
    step = Graded(np.array([0.0, 1, 1, 2]), np.zeros((4, 3)), np.array([1.0, 1, 5, 5]), 0, 0)
    np.testing.assert_array_equal(step.at([np.nextafter(1, 0), 1, 2], 0)[1], [1, 5, 5])


def test_a_contour_is_levoys() -> None:
    contour = Contour(100.0, 2.0, (0.2, 0.4, 0.6), 3.0)
    random = np.random.default_rng(2)
    values, magnitudes = random.uniform(80, 120, 1000), random.uniform(0.01, 20, 1000)
    expected = np.array([max(0, 1 - abs(v - 100) / (2 * m)) for v, m in zip(values, magnitudes, strict=True)])
    emission, extinction = contour.at(values, magnitudes)
    assert 0.1 < np.mean(expected > 0) < 0.9
    np.testing.assert_allclose(extinction, 3 * expected, rtol=1e-12)
    np.testing.assert_allclose(emission, np.outer(expected, (0.2, 0.4, 0.6)), rtol=1e-12)


def test_without_a_gradient_a_contour_is_its_value_alone() -> None:
    contour = Contour(5.0, 1.0, WHITE, 1.0)
    with np.errstate(all="raise"):
        weights = contour.weights([5, np.nextafter(5, 6), 4, np.nan, np.inf], 0)
    np.testing.assert_array_equal(weights, [1, 0, 0, 0, 0])
    np.testing.assert_array_equal(contour.weights([5, 6, np.nan, np.inf], [np.nan, np.nan, 1, np.inf]), [1, 0, 0, 0])


def everything(**changes: Any) -> TransferFunction:
    """A function with matter of every kind."""
    given: dict[str, Any] = {
        "values": [0, 10, 20],
        "colors": [[0, 0, 0], [3, 2, 1], [0.1, 0.2, 0.3]],
        "extinctions": [0, 4, 1],
        "premultiplied": True,
        "modulation": [[1, 0], [5, 2]],
        "graded": (ramp(),),
        "contours": (Contour(15, 0.5, (0.1, 0.2, 0.3), 0.7), Contour(3, 0.25, (0, 0, 1), 0)),
        "materials": ("fat", "bone"),
    }
    return TransferFunction(**given | changes)


@pytest.mark.parametrize("emissive", [False, True])
def test_matter_adds_up(emissive: bool) -> None:
    function = everything(premultiplied=not emissive, emissive=emissive)
    random = np.random.default_rng(3)
    values, magnitudes = random.uniform(-5, 25, (20, 30)), random.uniform(0, 10, (20, 30))
    emission, extinction = function.classify(values, magnitudes)
    factor = np.clip((magnitudes - 1) / 4, 0, 1) * 2
    expected = np.interp(values, [0, 10, 20], [0, 4, 1]) * factor
    blue = np.interp(values, [0, 10, 20], [0, 1, 0.3]) * factor
    for further in (*function.graded, *function.contours):
        more = further.at(values, magnitudes)
        expected, blue = expected + more[1], blue + more[0][..., 2]
    np.testing.assert_allclose(extinction, expected, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(emission[..., 2], blue, rtol=1e-12, atol=1e-14)


def test_values_and_magnitudes_are_broadcast() -> None:
    function = everything()
    grid = function.classify(np.arange(4.0)[:, np.newaxis], np.arange(3.0))
    assert grid.emission.shape == (4, 3, 3) and grid.extinction.shape == (4, 3)
    one = function.classify(3.0, 2.0)
    np.testing.assert_array_equal(grid.emission[3, 2], one.emission)


def test_straight_points_are_modulated_as_color_times_extinction() -> None:
    function = TransferFunction([0, 2], [[0, 0, 0], [1, 0.5, 0.25]], [0, 4], modulation=[[0, 0.5], [2, 1.5]])
    emission, extinction = function.classify([1, 1, 1], [-0.0, 1, 9])
    np.testing.assert_allclose(extinction, [1, 2, 3])
    np.testing.assert_allclose(emission, np.outer([1, 2, 3], [0.5, 0.25, 0.125]))


@pytest.mark.parametrize("kind", ["straight", "premultiplied", "emissive"])
def test_a_factor_of_0_removes_opaque_matter_and_any_other_leaves_it(kind: str) -> None:
    flags = {"premultiplied": kind == "premultiplied", "emissive": kind == "emissive"}
    function = TransferFunction([0], [[0.2, 0.4, 0.8]], [np.inf], modulation=[[1, 0], [2, 1e-9]], **flags)
    with np.errstate(all="raise"):
        emission, extinction = function.classify([0, 0, 0], [0, 1.5, 3])
    np.testing.assert_array_equal(extinction, [0, np.inf, np.inf])
    shown = np.zeros(3) if kind == "emissive" else [0.2, 0.4, 0.8]
    np.testing.assert_array_equal(emission, [[0, 0, 0], shown, shown])


def test_opaque_matter_hides_what_depends_on_the_gradient() -> None:
    graded = Graded(np.array([-1.0, 2]), np.full((2, 3), 0.5), np.ones(2), 0, 0)
    function = TransferFunction([0, 1, 1], np.eye(3), [0, 0, np.inf], graded=[graded])
    emission, extinction = function.classify([0.5, 1.5], 1)
    np.testing.assert_array_equal(extinction, [1, np.inf])
    np.testing.assert_array_equal(emission, [[0.5] * 3, [0, 0, 1]])


def test_nan_is_nothing_and_a_gradient_that_is_nan_counts_as_0() -> None:
    function = everything()
    emission, extinction = function.classify([np.nan, 15], [3, np.nan])
    assert extinction[0] == 0 and not emission[0].any()
    assert extinction[1] == pytest.approx(0.7)


def test_magnitudes_are_wanted_only_where_they_matter() -> None:
    plain = TransferFunction([0], [WHITE], [1])
    assert not plain.needs_gradient
    assert plain.classify(0.0).extinction == plain.classify(0.0, None).extinction == plain.classify(0.0, 3.0).extinction
    for changes in ({"graded": ()}, {"contours": (), "modulation": None}, {"graded": (), "contours": ()}):
        function = everything(**changes)
        assert function.needs_gradient
        with pytest.raises(
            InputError, match="transfer function: magnitudes must be given, since the medium depends on the gradient"
        ):
            function.classify(0.0)


def test_premultiplied_points_are_linear_in_emission_and_opaque_ones_show_their_color() -> None:
    function = TransferFunction(
        [0, 2, 2, 4], np.outer([0, 6, 1, 0.5], (1, 0.5, 0)), [0, 8, np.inf, np.inf], False, "", True
    )
    emission, extinction = function.classify([1, 2, 3, np.nan])
    np.testing.assert_allclose(extinction, [4, np.inf, np.inf, 0])
    np.testing.assert_allclose(emission[:, 0], [3, 1, 0.75, 0])


def test_what_may_show_is_never_missed() -> None:
    random = np.random.default_rng(5)
    grid = np.linspace(0, 1, 41)
    seen = hidden = 0
    for _ in range(300):
        values = np.sort(random.uniform(0, 10, 3))
        weights = random.choice([0, 0, 0.5], 3)
        graded_values = np.sort(random.uniform(0, 10, 3))
        start = random.uniform(0, 4)
        function = TransferFunction(
            values,
            np.outer(weights, WHITE),
            weights,
            premultiplied=True,
            modulation=[[1, random.choice([0, 1])], [2, 0], [3, random.choice([0, 1])]]
            if random.random() < 0.7
            else None,
            graded=[
                Graded(
                    graded_values, np.zeros((3, 3)), random.choice([0, 0, 1], 3), start, start + random.choice([0, 1])
                )
            ],
            contours=[Contour(random.uniform(0, 10), random.uniform(0.1, 1), WHITE, random.choice([0, 1]))],
        )
        lowest, largest = random.uniform(-1, 10), random.choice([0, random.uniform(0, 5)])
        highest = lowest + random.choice([0, random.uniform(0, 1)])
        inside = lowest + (highest - lowest) * grid
        shown = function.classify(inside[:, np.newaxis], largest * grid).extinction.any()
        may_show = bool(function.shows_between(lowest, highest, largest))
        assert may_show or not shown
        assert function.shows_between(lowest, highest) or not may_show
        seen, hidden = seen + shown, hidden + (not may_show)
    assert seen > 60 and hidden > 60


def test_what_can_not_show_is_left_out() -> None:
    nothing = TransferFunction([0], [(0, 0, 0)], [0], graded=[ramp(2, 6)])
    lowest, highest = np.array([0.0, 1.5, 1.5, 4.5, np.nan]), np.array([0.9, 2, 2, 9, np.nan])
    np.testing.assert_array_equal(nothing.shows_between(lowest, highest), [False, True, True, False, False])
    reach = np.array([9.0, 1.9, 2.1, 9, 9])
    np.testing.assert_array_equal(nothing.shows_between(lowest, highest, reach), [False, False, True, False, False])
    always = TransferFunction([0], [(0, 0, 0)], [0], graded=[ramp(0, 0)])
    assert always.shows_between(2, 3, 0)
    contour = TransferFunction([0], [(0, 0, 0)], [0], contours=[Contour(10, 0.5, WHITE, 1)])
    np.testing.assert_array_equal(contour.shows_between([8, 8, 9.5], [9, 9, 10.5], [1.9, 2.1, 0]), [False, True, True])
    modulated = TransferFunction([0], [WHITE], [1], modulation=[[0, 0], [1, 0], [2, 1]])
    np.testing.assert_array_equal(modulated.shows_between(0, 1, [0, 0.9, 1.1]), [False, False, True])
    never = TransferFunction([0], [WHITE], [1], modulation=[[0, 0]])
    assert not never.shows_between(0, 1)


def test_a_function_is_what_its_json_says_of_everything() -> None:
    opaque = everything(
        values=[0, 10, 10], extinctions=[0, 4, np.inf], colors=[[0, 0, 0], [1 / 3, 2, 1], [0.1, 0.2, 0.3]]
    )
    for function in (everything(), opaque, everything(emissive=True, premultiplied=False)):
        again = transfer.loads(json.dumps(function.as_json()))
        for name in ("values", "colors", "extinctions", "emissive", "premultiplied", "modulation", "materials"):
            np.testing.assert_array_equal(getattr(again, name), getattr(function, name))
        assert again.contours == function.contours
        assert len(again.graded) == len(function.graded)
        for one, other in zip(again.graded, function.graded, strict=True):
            for name in ("values", "emissions", "extinctions", "start", "full"):
                np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def graded_of(**changes: Any) -> Graded:
    given = {"values": [0.0, 1], "emissions": np.zeros((2, 3)), "extinctions": [0.0, 1], "start": 0, "full": 1}
    return Graded(**given | changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"values": []}, r"graded medium must have n values, emissions of shape \(n, 3\) and n extinctions, with n at"),
        ({"values": [0.0]}, "n values"),
        ({"emissions": np.zeros(2)}, "n values"),
        ({"values": [1.0, 0]}, "graded medium: values must ascend, got 0 after 1"),
        ({"values": [0.0, np.nan]}, "values must be finite"),
        ({"values": [0.0, 1e308]}, r"graded medium: values must be finite and at most 8e\+307 in size"),
        ({"emissions": np.full((2, 3), -1.0)}, "emission must be finite and not negative"),
        ({"extinctions": [0.0, np.inf]}, "extinction must be finite"),
        ({"extinctions": [0.0, np.nan]}, "extinction must be finite"),
        ({"start": 2}, "graded medium: the gradient range must rise from at least 0, got 2 to 1"),
        ({"start": -1}, "graded medium: the gradient range must rise from at least 0, got -1 to 1"),
        ({"full": np.inf}, "graded medium: the gradient range must rise from at least 0, got 0 to inf"),
    ],
)
def test_graded_matter_that_is_wrong_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        graded_of(**changes)


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"value": np.nan}, "value must be finite"),
        ({"thickness": 0}, "thickness must be a finite number above 0, got 0"),
        ({"thickness": np.inf}, "contour: thickness must be a finite number above 0"),
        ({"emission": (0, 0)}, r"contour: emission must be three finite numbers of at least 0"),
        ({"emission": (0, 0, -1)}, r"contour: emission must be three finite numbers of at least 0"),
        ({"extinction": np.inf}, "extinction must be finite"),
        ({"extinction": -1}, "extinction must be finite and not negative, got -1"),
    ],
)
def test_a_contour_that_is_wrong_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Contour(**{"value": 0, "thickness": 1, "emission": WHITE, "extinction": 1} | changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "changes, message",
    [
        (
            {"modulation": []},
            r"transfer function: gradient must be a list of pairs \[magnitude, factor\]",
        ),
        (
            {"modulation": [1, 2]},
            r"transfer function: gradient must be a list of pairs \[magnitude, factor\]",
        ),
        ({"modulation": [[0, -1]]}, "must be finite and not negative"),
        ({"modulation": [[0, np.inf]]}, "must be finite and not negative"),
        ({"modulation": [[1, 0], [1, 1]]}, "transfer function: gradient magnitudes must ascend, got 1 after 1"),
        ({"emissive": True}, "either emissive or premultiplied"),
        ({"premultiplied": False}, "transfer function: colours must be from 0 to 1, got 3"),
    ],
)
def test_a_function_that_is_wrong_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        everything(**changes)
