"""Hundreds of random actions of mouse, keyboard and window: nothing breaks, and memory does not grow."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from support.random_actions import (
    FREED_AT_ONCE,
    KINDS,
    channels_over_time,
    check_window,
    grown,
    random_steps,
    with_repeats,
)
from support.windows import ball, display  # noqa: F401 (display is a fixture)

# `python scripts/window_actions.py` plays any number of actions.
ACTIONS, REPEATED = 200, 150
SEEDS = 1, 2


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "opens"), [*zip(SEEDS, (ball, channels_over_time), strict=True)])
def test_random_actions_leave_the_window_whole(
    display: str,  # noqa: F811
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    seed: int,
    opens: Callable[[Path], str],
) -> None:
    for name, value in FREED_AT_ONCE.items():
        monkeypatch.setenv(name, value)
    check_window(display, tmp_path, opens(tmp_path), seed, ACTIONS, REPEATED)


def test_what_stays_is_growth_and_what_comes_and_goes_is_not() -> None:
    steady = [100 + 2 * number for number in range(60)]
    assert grown(steady[:20], steady[20:40], steady[40:]) == 2 * 20
    rough = [each + 44 * (number % 7 == 5) for number, each in enumerate(steady)]
    assert grown(rough[:20], rough[20:40], rough[40:]) == 2 * 20
    assert grown([100], [100] * 20, [100, 144, 144, 100] * 5) == 0
    assert grown([7], [7, 20, 60, 98, 98, 98], [98] * 6) == 0, "a process that begins late"
    assert grown([], [7, 8, 9], [50, 60, 70]) == 0


def test_every_kind_of_action_is_played() -> None:
    for seed in SEEDS:
        played = {step.get("kind", step.get("do")) for step in random_steps(seed, ACTIONS)}
        assert played == KINDS.keys()


def test_the_repeats_are_the_first_actions_again() -> None:
    steps = with_repeats(random_steps(1, ACTIONS), REPEATED)
    begins = [number for number, step in enumerate(steps) if step.get("do") == "screenshot"]
    one, other = steps[begins[0] + 1 : begins[1]], steps[begins[1] + 1 : begins[2]]
    assert begins[3:] == [] and begins[2] == len(steps) - 1
    assert [step | {"t": 0} for step in one] == [step | {"t": 0} for step in other]
    assert len(one) > REPEATED and [step["t"] for step in steps] == sorted(step["t"] for step in steps)
