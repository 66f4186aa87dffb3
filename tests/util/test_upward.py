"""Upper bounds as text."""

from __future__ import annotations

import numpy as np
import pytest

from texvol.util.upward import upward


@pytest.mark.parametrize(
    ("number", "text"),
    [(0.014, "0.014"), (0.0141, "0.015"), (0.0995, "0.1"), (0.101, "0.11"), (1.01e-7, "1.1e-07"), (0.0, "0"), (3, "3")]
    + [(float("inf"), "inf"), (float("nan"), "nan")],
)
def test_two_digits_rounded_up(number, text):
    assert upward(number) == text


def test_no_text_is_less_than_its_number():
    numbers = 10 ** np.random.default_rng(1).uniform(-12, 3, 500)
    for digits in (1, 2, 3):
        shown = np.array([float(upward(each, digits)) for each in numbers])
        assert (shown >= numbers).all() and (shown < numbers * (1 + 10 ** (1 - digits)) * (1 + 1e-12)).all()
