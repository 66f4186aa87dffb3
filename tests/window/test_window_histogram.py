"""The histogram of any volume that can be drawn."""

from __future__ import annotations

import numpy as np
import pytest

from texvol.scene.volume import Volume
from texvol.window.histogram import histogram_of

LARGEST = float(np.finfo(np.float64).max)


@pytest.mark.parametrize(
    "values",
    [
        np.full(8, 1e30, np.float32),
        np.array([1e30, np.nan] * 4, np.float32),
        np.full(8, -LARGEST / 4),
        np.array([0.0, 5e-324] * 4),
        np.full(8, 7, np.uint8),
        np.full(8, 2**60),
        np.array([2**60, 2**60 + 3] * 4),
        np.linspace(1e9, np.nextafter(1e9, 2e9), 8),
    ],
)
def test_a_hardly_changing_volume_has_one(values: np.ndarray) -> None:
    """Between neighbouring numbers there is no room for columns, and one number has no width."""
    found = histogram_of(Volume(values.reshape(2, 2, 2)))
    assert np.isfinite(found.edges).all() and (np.diff(found.edges) > 0).all()
    assert found.counts.sum() == np.isfinite(values).sum()
    assert 0 < np.nanmax(found.heights(True)) <= 1


def test_values_too_far_apart_for_a_difference_are_left_out() -> None:
    found = histogram_of(Volume(np.array([-LARGEST, 0.0, 1.0, LARGEST] * 2).reshape(2, 2, 2)))
    assert np.isfinite(np.diff(found.edges)).all() and found.counts.sum() == 4
    assert histogram_of(Volume(np.full((2, 2, 2), LARGEST))).counts.sum() == 0


def test_whole_numbers_have_a_column_each() -> None:
    found = histogram_of(Volume(np.array([3, 3, 4, 5, 5, 5, 9, 9], np.uint8).reshape(2, 2, 2)))
    assert list(found.counts) == [2, 1, 3, 0, 0, 0, 2] and found.edges[0] == 2.5
