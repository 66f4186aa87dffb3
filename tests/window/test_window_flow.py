"""Frames under way to a viewer: many on a long link, few on a congested one and to a slow viewer, none stale."""

from __future__ import annotations

import heapq
from statistics import median
from typing import NamedTuple

import pytest

from texvol.window.remote.flow import MOST, Flow


class Seen(NamedTuple):
    """Frames per second that a viewer draws, the median age at which it draws them, and the most under way at once."""

    rate: float
    age: float
    most: int


def seen(delay: float, transfer: float, draw: float, seconds: float = 8.0) -> Seen:
    """What a viewer sees of 30 frames per second over a link of a `delay` each way; a frame takes `transfer` on it."""
    now = [0.0]
    flow = Flow(lambda: now[0])
    waiting: list[tuple[float, int]] = [(0.0, 0)]  # times, and numbers of frames that have been drawn; 0: a new frame
    newest, sent, number, most = 0.0, -1.0, 0, 0
    link_free = viewer_free = 0.0
    under_way, ages = set[int](), []
    while now[0] < seconds:
        now[0], which = heapq.heappop(waiting)
        if which:
            flow.drawn(which)
            under_way.discard(which)
        else:
            newest = now[0]
            heapq.heappush(waiting, (newest + 1 / 30, 0))
        if newest > sent and flow.is_open:
            sent, number = newest, number + 1
            flow.send(number)
            under_way.add(number)
            link_free = max(link_free, now[0]) + transfer
            viewer_free = max(viewer_free, link_free + delay) + draw
            heapq.heappush(waiting, (viewer_free + delay, number))
            if now[0] > 2:
                ages.append(viewer_free - newest)
                most = max(most, len(under_way))
    return Seen(len(ages) / (seconds - 2), median(ages), most)


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.04, 0.1])
def test_every_frame_is_seen_on_a_link_with_a_delay_alone(delay: float) -> None:
    found = seen(delay, 0.001, 0.01)
    assert found.rate > 28  # of 30; each round trip that measures the link costs a few
    assert found.age < delay + 0.011 + 0.001


@pytest.mark.parametrize(
    "delay, transfer, draw", [(0.0, 0.12, 0.01), (0.04, 0.12, 0.01), (0.0, 0.001, 0.1), (0.04, 0.001, 0.1)]
)
def test_a_slow_link_and_a_slow_viewer_are_kept_busy_and_one_frame_waits(
    delay: float, transfer: float, draw: float
) -> None:
    found, slowest = seen(delay, transfer, draw), max(transfer, draw)
    assert found.rate > 0.9 / slowest  # with one frame under way it is 1 / (transfer + draw + 2 delay)
    # Its own way, a frame and a quarter that wait, and the time since the window drew it.
    assert found.age < delay + transfer + draw + 1.25 * slowest + 1 / 30
    assert found.most <= 2 + (2 * delay + transfer + draw) / slowest


def test_a_link_that_becomes_slower_is_measured_anew() -> None:
    now = [0.0]
    flow = Flow(lambda: now[0])

    def round_trip(number: int, seconds: float) -> None:
        flow.send(number)
        now[0] += seconds
        flow.drawn(number)

    for number in range(1, 20):
        round_trip(number, 0.01)
    flow.send(20)
    assert flow.is_open
    now[0] += 11.0
    assert not flow.is_open, "the measure is old"
    flow.drawn(20)
    for number in range(21, 40, 2):
        flow.send(number)
        flow.send(number + 1)
        now[0] += 0.3
        flow.drawn(number)
        flow.drawn(number + 1)
    flow.send(41)
    assert flow.is_open, "0.3 seconds are no queue any more"


def test_a_viewer_that_draws_nothing_gets_no_more() -> None:
    now = [0.0]
    flow = Flow(lambda: now[0])
    number = 0
    for _ in range(100):  # frames that come at once let the number grow
        while flow.is_open and number < 10_000:
            number += 1
            flow.send(number)
        now[0] += 0.05
        flow.drawn(number)
    sent = number
    while flow.is_open and number < sent + 1000:
        number += 1
        flow.send(number)
    assert number - sent <= MOST
