"""Gestures in the plot: what the mouse is at, and what a drag makes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from texvol.scene.transfer import TransferFunction, adjusting
from texvol.window import lineage
from texvol.window.editing import opacity_of
from texvol.window.gestures import Drag, Frame, Hit, hit, notched, widened

LENGTH = 2.0
FRAME = Frame((-100.0, 300.0), 20.0, 30.0, 400.0, 200.0)  # a pixel is a unit
TRIANGLE = TransferFunction([0.0, 100.0, 200.0], [(1, 0, 0), (0, 1, 0), (0, 0, 1)], [0.0, 0.5, 0.0])


def at(value: float, opacity: float) -> tuple[float, float]:
    return FRAME.x(value), FRAME.y(opacity)


@given(st.floats(-100, 300), st.floats(0, 1))
def test_positions_are_found_again(value: float, opacity: float) -> None:
    assert FRAME.value(FRAME.x(value)) == pytest.approx(value, abs=1e-9)
    assert FRAME.opacity(FRAME.y(opacity)) == pytest.approx(opacity, abs=1e-12)
    assert FRAME.rounded(value) == round(value)


@pytest.mark.parametrize("width, wanted", [(4e-5, 1.2345678), (4e-2, 1.2346), (4.0, 1.23), (4e3, 0.0)])
def test_values_have_the_decimals_of_a_pixel(width: float, wanted: float) -> None:
    frame = Frame((0.0, width), 0.0, 0.0, 400.0, 200.0)
    assert frame.rounded(1.2345678) == wanted


def test_the_mouse_is_at_a_point_an_end_or_the_curve() -> None:
    top = float(opacity_of(0.5, LENGTH))
    found = [
        hit(FRAME, TRIANGLE, LENGTH, at(value, opacity), 10.0)
        for value, opacity in ((103, top), (200, 0.5), (3, 0.5), (100, 0.3), (50, 0.9), (250, 0.0), (-50, 0.2))
    ]
    assert found == [
        Hit("point", 1), Hit("high"), Hit("low"), Hit("curve"), Hit("empty"), Hit("empty"), Hit("empty"),
    ]  # fmt: skip


def test_of_points_in_one_place_the_upper_one_is_taken() -> None:
    step = TransferFunction([0.0, 50.0, 50.0, 100.0], np.zeros((4, 3)), [0.0, 0.5, np.nextafter(0.5, 1), 1.0])
    assert hit(FRAME, step, LENGTH, at(50, float(opacity_of(0.5, LENGTH))), 10.0) == Hit("point", 2)


def dragged(what: Hit, start: tuple[float, float], end: tuple[float, float], **how: bool) -> TransferFunction:
    return Drag(TRIANGLE, what, at(*start), **how).moved(FRAME, *at(*end), LENGTH)


def test_the_curve_is_shifted_as_by_the_option() -> None:
    found = dragged(Hit("curve"), (100, 0.3), (137.4, 0.35))
    assert np.array_equal(found.values, adjusting.between(TRIANGLE, 37.0, 237.0).values)
    assert np.array_equal(found.extinctions, TRIANGLE.extinctions)


def test_the_curve_is_pulled_up_to_the_mouse() -> None:
    top = float(opacity_of(0.5, LENGTH))
    found = dragged(Hit("curve"), (100, 0.3), (101, 0.5), upright=True)
    factor = lineage.lineage_of(found).factor
    assert float(opacity_of(found.at(100)[3], LENGTH)) == pytest.approx(top + 0.2, abs=0.002)
    assert np.array_equal(found.extinctions, adjusting.denser(TRIANGLE, factor).extinctions)
    assert factor == float(f"{factor:.3g}")


def test_a_curve_is_widened_about_the_mouse() -> None:
    wider = dragged(Hit("curve"), (50, 0.2), (150, 0.2), widens=True)
    low, high = adjusting.ends(wider)
    assert high - low == pytest.approx(200 * np.exp(0.75), abs=1)
    assert (50 - low) / (high - low) == pytest.approx(0.25, abs=0.01)
    assert dragged(Hit("curve"), (50, 0.2), (-300, 0.2), widens=True).values[-1] > low


@pytest.mark.parametrize("kind, by, wanted", [("low", -30.2, (-30, 200)), ("high", 30.2, (0, 230)), ("low", 500, None)])
def test_an_end_is_dragged_alone(kind: str, by: float, wanted: tuple[float, float] | None) -> None:
    found = dragged(Hit("low" if kind == "low" else "high"), (0, 0.5), (by, 0.5))
    low, high = adjusting.ends(found)
    assert low < high
    assert wanted is None or (low, high) == wanted


def test_a_point_is_dragged_as_far_as_its_neighbours() -> None:
    top = float(opacity_of(0.5, LENGTH))
    found = dragged(Hit("point", 1), (100, top), (160, 0.4))
    assert found.values.tolist() == [0, 160, 200]
    assert float(opacity_of(found.extinctions[1], LENGTH)) == pytest.approx(0.4)
    assert dragged(Hit("point", 1), (100, top), (260, 0.4)).values.tolist() == [0, 200, 200]
    across = dragged(Hit("point", 1), (103, top - 0.02), (143, top - 0.02))
    assert across.extinctions[1] == 0.5, "a drag along the values leaves the extinction"


def test_an_opaque_point_stays_opaque_until_it_is_dragged_down() -> None:
    opaque = TransferFunction([0.0, 100.0], [(0, 0, 0), (1, 1, 1)], [0.0, np.inf])
    drag = Drag(opaque, Hit("point", 1), at(100, 1.0))
    assert np.isinf(drag.moved(FRAME, *at(80, 0.995), LENGTH).extinctions[1])
    assert drag.moved(FRAME, *at(80, 0.7), LENGTH).extinctions[1] == pytest.approx(-np.log(0.3) / LENGTH)


@given(st.floats(-5, 5), st.floats(-50, 250))
def test_the_wheel_keeps_the_value_at_the_mouse(notches: float, about: float) -> None:
    low, high = adjusting.ends(widened(TRIANGLE, FRAME, about, notched(notches)))
    assert low < high
    assert (about - low) / (high - low) == pytest.approx(about / 200, abs=1.5 / (high - low))
