"""Time that is left of some work."""

from __future__ import annotations

import pytest

from texvol.util.time_left import TimeLeft, duration


def test_work_at_a_steady_speed_ends_when_it_is_said_to() -> None:
    left = TimeLeft()
    for number in range(1, 9):
        left.learn(number / 20, 7 + 3 * number)  # the seconds before the first fraction do not count
    assert left.seconds(31) == pytest.approx(36)
    assert left.text(31) == "36 s left" and left.seconds(34) == pytest.approx(33)
    assert left.seconds(1000) == 0 and left.text(1000) == "1 s left"


def test_the_speed_is_that_of_the_last_steps() -> None:
    left = TimeLeft()
    for number in range(500):
        left.learn(number / 1000, 0.1 * number if number < 400 else 40 + (number - 400))
    assert left.seconds(139) == pytest.approx(501, rel=0.01)


def test_work_that_nearly_halts_is_not_said_to_take_for_ever() -> None:
    left = TimeLeft()
    for number in range(25):
        left.learn(0.01 * number, 0.4 * number)
    for number in range(100):  # more is to be done than was expected: the fraction hardly grows for as long again
        left.learn(0.25 + 1e-6 * number, 10 + 0.1 * number)
    # A tenth has been done in the last 10 s and the 4 s before them.
    assert left.seconds(19.9) == pytest.approx(0.75 * 14 / 0.1, rel=0.05)


def test_nothing_is_said_before_the_speed_is_known() -> None:
    left = TimeLeft()
    assert left.seconds(0) is None and left.text(0) == ""
    left.learn(0.1, 0.0)
    left.learn(0.1, 5.0)
    assert left.seconds(5.0) is None, "nothing has been done since"
    left.learn(0.2, 5.5)
    assert left.seconds(5.5) is not None
    left.learn(0.01, 6.0)
    assert left.seconds(6.0) is None, "other work has begun"


def test_durations_are_words() -> None:
    assert [duration(each) for each in (0, 12.4, 99, 100, 3000, 3 * 3600 + 300)] == [
        *("1 s", "12 s", "99 s", "2 min", "50 min", "3 h 5 min")
    ]
