"""Axes of different units: a box that would be a line is drawn as a box."""

from __future__ import annotations

import numpy as np
import pytest

from texvol import Volume
from texvol.scene.proportions import in_proportion

VALUES = np.zeros((5, 10, 20))
SPACE = "lon (degrees_east), lat (degrees_north), lev (Pa)"


def test_an_axis_of_another_unit_is_half_as_long_as_the_longest_other() -> None:
    volume = Volume(VALUES, (2, 2, 20000), (0, 0, 100), space=SPACE)
    found = in_proportion(volume)
    np.testing.assert_allclose(np.diag(found.box_edges), (40, 20, 20))
    assert found is in_proportion(volume) and found.values is volume.values


@pytest.mark.parametrize(
    "spacing, space",
    [
        ((2, 2, 2), SPACE),
        ((2, 2, 20000), "x (m), y (m), z (m)"),
        ((2, 2, 20000), "right-anterior-superior"),
        ((2, 2, 20000), ""),
    ],
)
def test_all_else_stays_as_it_is(spacing: tuple[float, float, float], space: str) -> None:
    volume = Volume(VALUES, spacing, space=space)
    assert in_proportion(volume) is volume
