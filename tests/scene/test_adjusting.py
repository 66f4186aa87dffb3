"""Transfer functions shifted, scaled and made denser."""

from __future__ import annotations

import numpy as np
import pytest
from support.scenes import random_volume

from texvol import TransferFunction
from texvol.scene.transfer import PRESETS, adjusting, preset

VOLUME = random_volume(3)


@pytest.mark.parametrize("name", PRESETS)
def test_values_of_a_range_look_like_those_of_another(name: str) -> None:
    medium = preset(name, VOLUME)
    parts = [medium.values, *(each.values for each in medium.graded), [each.value for each in medium.contours]]
    if medium.needs_gradient and not (medium.extinctions > 0).any():
        parts = parts[1:]
    ends = np.concatenate([np.asarray(each, float) for each in parts])
    low, high = ends.min(), ends.max()
    moved = adjusting.between(medium, -50, 150)
    fractions = np.linspace(0, 1, 37) if high > low else np.zeros(1)
    magnitudes = np.full(fractions.shape, 0.7)
    if medium.contours:  # whose thickness is in voxels: it goes with the gradient
        magnitudes = np.full(fractions.shape, 1e9)
    one = medium.classify(low + fractions * (high - low), magnitudes)
    other = moved.classify(-50 + 200 * fractions, magnitudes)
    np.testing.assert_allclose(other.extinction, one.extinction, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(other.emission, one.emission, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("name", PRESETS)
def test_a_denser_medium_has_more_of_the_same(name: str) -> None:
    medium = preset(name, VOLUME)
    denser = adjusting.denser(medium, 3.0)
    values, magnitudes = np.linspace(-1, 2, 61), np.full(61, 0.7)
    one, other = (each.classify(values, magnitudes) for each in (medium, denser))
    finite = np.isfinite(one.extinction)
    np.testing.assert_allclose(other.extinction[finite], 3 * one.extinction[finite])
    np.testing.assert_allclose(other.emission[finite], 3 * one.emission[finite])
    np.testing.assert_array_equal(other.emission[~finite], one.emission[~finite])


def test_an_opaque_medium_stays_opaque_until_it_is_gone() -> None:
    opaque = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, np.inf]))
    assert adjusting.denser(opaque, 0.5).extinctions.tolist() == [0, np.inf]
    assert adjusting.denser(opaque, 0.0).extinctions.tolist() == [0, 0]


def test_a_constant_medium_lies_in_the_middle_of_its_range() -> None:
    constant = TransferFunction(np.array([7.0]), np.ones((1, 3)), np.ones(1))
    assert adjusting.between(constant, 0, 10).values.tolist() == [5]
