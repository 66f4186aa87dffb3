"""A range on a track: which end a hand takes, and that no drag makes another range than it should."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from texvol.window.ranges import Hold

BOUNDS = (0.0, 100.0)
REACH, LEAST = 4.0, 0.1
fractions = st.floats(0, 1)
positions = st.floats(-300, 300)


@pytest.mark.parametrize(
    "at, low, high",
    [(18, True, False), (23, True, False), (50, True, True), (78, False, True), (5, True, False), (99, False, True)],
)
def test_a_hand_takes_an_end_or_what_is_between_them(at: float, low: bool, high: bool) -> None:
    hold = Hold.taken((20.0, 80.0), at, REACH)
    assert (hold.low, hold.high) == (low, high)


def test_a_narrow_range_can_still_be_moved_as_a_whole_and_by_each_end() -> None:
    ends = (50.0, 53.0)  # narrower than a handle's reach
    found = [Hold.taken(ends, at, REACH) for at in (50.2, 51.5, 52.8)]
    assert [(each.low, each.high) for each in found] == [(True, False), (True, True), (False, True)]


def test_a_handle_does_not_jump_when_it_is_taken_but_comes_from_afar() -> None:
    assert Hold.taken((20.0, 80.0), 22.0, REACH).moved(22.0, BOUNDS, LEAST) == (20, 80)
    assert Hold.taken((20.0, 80.0), 5.0, REACH).moved(5.0, BOUNDS, LEAST) == (5, 80)


@given(first=fractions, width=st.floats(0.01, 1), at=positions, there=positions)
def test_ends_stay_in_order_and_within_the_bounds(first: float, width: float, at: float, there: float) -> None:
    low = 100 * first * (1 - width)
    ends = low, low + 100 * width
    hold = Hold.taken(ends, at, REACH)
    found = hold.moved(there, BOUNDS, LEAST)
    rounding = 1e-12 * (abs(at) + abs(there) + 100)
    # The bounds hold but for what the range was beyond them by rounding.
    assert found[1] - found[0] >= LEAST - rounding and found[0] >= -rounding and found[1] <= 100 + rounding
    if hold.low and hold.high:
        assert found[1] - found[0] == pytest.approx(ends[1] - ends[0])
    else:
        assert found[hold.low] == ends[hold.low], "the other end stays"


def test_a_range_that_reaches_beyond_the_histogram_is_not_cut_when_it_is_touched() -> None:
    wide = (-50.0, 150.0)
    assert Hold.taken(wide, 50.0, REACH).moved(80.0, BOUNDS, LEAST) == wide
    assert Hold.taken(wide, -49.0, REACH).moved(-80.0, BOUNDS, LEAST) == wide
    assert Hold.taken(wide, -49.0, REACH).moved(11.0, BOUNDS, LEAST) == (10, 150)
