"""The oracle and the mistakes of a comparison stop when they would take longer than a limit."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from texvol.comparison.patience import Patience, TooSlow


def clock(*times: float) -> Callable[[], float]:
    seconds = iter(times)
    return lambda: next(seconds)


def test_an_oracle_that_would_take_longer_than_the_limit_is_given_up_at_once() -> None:
    # A hundredth of the picture took one second after the first call: 98 hundredths are left.
    tell = Patience(10, clock(50, 51)).of_oracle("candidate")
    tell(0.01)
    with pytest.raises(TooSlow, match="about 99 s longer; --oracle waits for it"):
        tell(0.02)


def test_time_before_the_first_part_does_not_count() -> None:
    tell = Patience(10, clock(500, 501, 502)).of_oracle("candidate")
    for fraction in (0.1, 0.5, 1.0):
        tell(fraction)


def test_the_pictures_share_the_limit() -> None:
    patience = Patience(10, clock(0, 6, 0, 5))
    first, second = patience.of_oracle("candidate"), patience.of_oracle
    first(0.0)
    first(1.0)
    tell = second("reference")
    tell(0.0)
    with pytest.raises(TooSlow):
        tell(1.0)


def test_without_a_limit_nothing_is_given_up() -> None:
    patience = Patience(None, clock(0, 1e6, 2e6, 3e6))
    tell = patience.of_oracle("candidate")
    tell(0.0)
    tell(0.001)
    assert not patience.of_mistakes()(1, 14)


def test_no_mistake_is_drawn_if_the_last_picture_took_too_long() -> None:
    is_over = Patience(10, clock(0, 4, 7, 11)).of_mistakes()
    assert not is_over(1, 14)  # 4 s spent, 4 s expected
    assert not is_over(2, 14)  # 7 s spent, 3 s expected
    assert is_over(3, 14)
