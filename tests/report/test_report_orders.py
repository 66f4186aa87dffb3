"""The orders of convergence that a report states."""

from __future__ import annotations

import numpy as np
import pytest

from texvol.rendering.renderer import Renderer
from texvol.report.orders import slope, smooth_order, trilinear_change


def test_a_slope_is_that_of_a_power_law() -> None:
    steps = np.array([1.0, 0.5, 0.25])
    assert slope(steps, 3 * steps**1.7) == pytest.approx(1.7)
    assert slope([1.0], [1.0]) is None
    assert slope([1.0, 0.5], [1.0, 0.0]) is None


def test_grids_have_the_orders_that_they_should(renderer: Renderer) -> None:
    # 7 slab stacks and 166 slabs round by 2^-24, positions by 2^-25 of 24 samples that differ by up to 1 each.
    assert trilinear_change(renderer) < 2e-6
    order = smooth_order(renderer)
    assert order is not None and 1.8 < order < 2.2
