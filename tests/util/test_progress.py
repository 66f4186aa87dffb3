"""Progress is told as fractions that never fall, and whoever hears it can end the work."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from texvol.scene.gradient import CENTRAL, gradients, largest_component
from texvol.scene.volume import Volume
from texvol.util import progress
from texvol.util.threads import in_threads


class Stop(Exception):
    """End of the work."""


def test_work_that_takes_what_was_expected_is_told_as_it_is() -> None:
    told: list[float] = []
    with progress.heard(told.append, 10.0):
        for _ in range(8):
            progress.advance(1.0)
    assert told == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8])


def test_more_work_than_expected_slows_down_and_is_not_over_before_its_end() -> None:
    told: list[float] = []
    with progress.heard(told.append, 1.0):
        for _ in range(100):
            progress.advance(0.1)
    assert told == sorted(told) and told[-1] < 1
    assert told[9] == pytest.approx(0.95) and told[-1] > 0.98


def test_a_new_expectation_never_lets_it_fall() -> None:
    told: list[float] = []
    with progress.heard(told.append, 2.0):
        progress.advance(1.0)
        progress.expect(30.0)
        progress.advance(15.0)
        progress.advance(11.9)
    assert told == pytest.approx([0.5, 0.75, 0.5 + 0.5 * 26.9 / 30])


def test_a_span_has_its_share_whatever_it_takes() -> None:
    told: list[float] = []
    with progress.heard(told.append, 1.0):
        with progress.span(0.25, 4.0):
            progress.advance(2.0)
            progress.advance(400.0)
        progress.expect(8.0)
        progress.advance(4.0)
    assert told[0] == pytest.approx(0.125) and 0.24 < told[1] < 0.25
    assert told[2] == pytest.approx(0.25 + 0.75 / 2)


def test_a_part_counts_its_pieces_and_no_more_than_its_seconds() -> None:
    told: list[float] = []
    with progress.heard(told.append, 10.0):
        with progress.part(4.0, pieces=2):
            progress.within(0.5)
            progress.within(0.5)
            progress.within(0.5)
            progress.within(3.0)
        progress.advance(1.0)
    assert told == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5])


def test_nobody_hears_and_nothing_is_told() -> None:
    assert not progress.is_heard()
    progress.advance(1.0)
    progress.within(0.5)
    with progress.part(1.0), progress.span(0.5, 1.0):
        assert not progress.is_heard()


def test_other_threads_tell_nothing() -> None:
    told: list[float] = []
    with progress.heard(told.append, 1.0):
        thread = threading.Thread(target=lambda: progress.advance(0.5))
        thread.start()
        thread.join()
    assert not told


def test_gradients_tell_how_far_they_are() -> None:
    volume = Volume(np.random.default_rng(2).random((70, 70, 70)).astype(np.float32))
    told: list[float] = []
    with progress.heard(told.append, 2 * 70**3 * 7e-9):
        largest_component(volume, CENTRAL)
    assert len(told) > 3 and told == sorted(told) and told[-1] == pytest.approx(0.5)


def test_gradients_are_ended_by_whoever_hears_them() -> None:
    volume = Volume(np.zeros((70, 70, 70), np.float32))
    heard: list[float] = []

    def hear(done: float) -> None:
        heard.append(done)
        raise Stop

    with progress.heard(hear, 1.0), pytest.raises(Stop):
        gradients(volume, CENTRAL)
    assert len(heard) == 1


def test_parts_that_have_not_begun_are_left_out() -> None:
    begun: list[int] = []

    def work(part: int) -> int:
        begun.append(part)
        time.sleep(0.01)
        return part

    def hear(done: float) -> None:
        raise Stop

    with progress.heard(hear, 1.0), pytest.raises(Stop):
        in_threads(work, range(500))
    assert len(begun) < 100
    assert in_threads(work, range(5)) == [0, 1, 2, 3, 4]
