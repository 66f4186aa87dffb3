"""Lanes: formulas hold for numbers and for eight of them at once, in compiled code as in numpy.

Nothing is cached here: cached code would not follow a change of `lanes`.
"""

from __future__ import annotations

import numpy as np
import pytest

from texvol.ray_casting.common.compiling import compiled
from texvol.ray_casting.common.lanes import (
    LANES,
    any_of,
    choice,
    greatest,
    greatest_of,
    lane,
    least,
    loaded,
    magnitude,
    power,
    root,
    shifted,
    spread,
    store,
    sum_of,
    transmitted,
    with_lane,
)
from texvol.ray_casting.lit.shading import raised

EPSILON = float(np.finfo(np.float64).eps)
NUMBERS = np.array([-3.0, 0.0, 0.25, 1.0, 1.5, 7.0, -0.5, 40.0])


@compiled
def formula(x):
    """Something of all that formulas of numbers and lanes may hold."""
    y = (2 * x - 1) / (x * x + 1.0) + 0.5 - x / 3
    return choice(x > 1.0, root(magnitude(y)), least(greatest(y, -0.5), 0.25)) + power(magnitude(x), 1.5)


@compiled
def _of_numbers(numbers, found):
    for k in range(LANES):
        found[k] = formula(numbers[k])


@compiled
def _of_lanes(numbers, found):
    store(formula(loaded(numbers)), found)


@compiled
def _rearranged(numbers, found):
    x = loaded(numbers)
    store(shifted(x), found[0])
    store(with_lane(x, 2, 9.0), found[1])
    store(spread(lane(x, 5)), found[2])
    return sum_of(x), greatest_of(x), any_of((x > 2.0) & (x < 7.0)), any_of((x > 2.0) & (x < 7.5))


@compiled
def _transmitted(depths, found):
    store(transmitted(loaded(depths)), found)


@compiled
def _raised(bases, exponent, found):
    store(raised(loaded(bases), exponent), found)


def expected_formula(x: np.ndarray) -> np.ndarray:
    y = (2 * x - 1) / (x * x + 1) + 0.5 - x / 3
    return np.where(x > 1, np.sqrt(np.abs(y)), np.clip(y, -0.5, 0.25)) + np.abs(x) ** 1.5


def test_a_formula_holds_for_numbers_and_lanes() -> None:
    of_numbers, of_lanes = np.zeros(LANES), np.zeros(LANES)
    _of_numbers(NUMBERS, of_numbers)
    _of_lanes(NUMBERS, of_lanes)
    # A few roundings, of numbers up to 40^1.5.
    np.testing.assert_allclose(of_numbers, expected_formula(NUMBERS), rtol=8 * EPSILON, atol=8 * EPSILON)
    np.testing.assert_allclose(of_lanes, of_numbers, rtol=8 * EPSILON, atol=8 * EPSILON)


def test_lanes_are_moved_and_gathered() -> None:
    found = np.zeros((3, LANES))
    total, largest, none_between, one_between = _rearranged(NUMBERS, found)
    np.testing.assert_array_equal(found[0], [*NUMBERS[1:], NUMBERS[-1]])
    np.testing.assert_array_equal(found[1], [*NUMBERS[:2], 9.0, *NUMBERS[3:]])
    np.testing.assert_array_equal(found[2], [7.0] * LANES)
    assert (total, largest, none_between, one_between) == (NUMBERS.sum(), 40.0, False, True)


@pytest.mark.parametrize("most", [1e-8, 1.0, 50.0, 699.0])
def test_what_a_depth_transmits_has_all_digits(most: float) -> None:
    depths, found = np.linspace(-0.01 * most, most, LANES), np.zeros(LANES)
    _transmitted(depths, found)
    np.testing.assert_allclose(found, np.exp(-depths), rtol=4 * EPSILON)


def test_beyond_all_depths_next_to_nothing_is_transmitted() -> None:
    found = np.ones(LANES)
    _transmitted(np.array([700.0, 800, 1e6, 1e300, np.inf, 710, 750, 2000]), found)
    assert (found <= np.exp(-700) * 1.001).all()


@pytest.mark.parametrize("exponent", [0.0, 1.0, 5.0, 32.0, 20.5, 1024.0, 1e5])
def test_powers_of_highlights(exponent: float) -> None:
    bases, found = np.array([0.0, 1e-3, 0.2, 0.5, 0.9, 0.99, 0.9999, 1.0]), np.zeros(LANES)
    _raised(bases, exponent, found)
    # Each square doubles the relative error of the factors before it.
    np.testing.assert_allclose(found, bases**exponent, rtol=max(exponent, 4) * EPSILON, atol=1e-300)
