"""Number of frames that may be under way to a viewer at once: as many as its link carries, and one that waits.

A frame that goes alone measures the round trip T₀: delay, transfer, and the time that the viewer takes to draw it. If n
frames were under way when one was sent, and it was drawn after T, then n T₀ / T of them were on their way and the rest
waited, in the link or at the viewer. Half of the step to

    n T₀ / T + 1¼

frames is taken each time (FAST TCP, Wei, Jin, Low and Hegde 2006; the quarter lets the whole number below grow): with a
long delay many frames are under way, on a congested link and with a slow viewer those that it carries, and one that
waits. A measure that is old is made anew.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

MOST = 32  # frames: 30 per second for a round trip of a second
_LASTS = 10.0  # seconds after which the round trip is measured anew, in case the link has changed
_WAITING = 1.25  # frames
_STEP = 0.5


class _Sent(NamedTuple):
    """Frame under way; `together` is the number of frames that were under way then, with it."""

    number: int
    at: float
    together: int


class Flow:
    """Frames under way to one viewer."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._under_way: deque[_Sent] = deque()
        self._limit = 1.0
        self._alone, self._measured_at = math.inf, -math.inf

    @property
    def is_open(self) -> bool:
        """True if another frame may be sent."""
        count = len(self._under_way)
        return not count or (count + 1 <= self._limit and self._clock() - self._measured_at < _LASTS)

    def send(self, number: int) -> None:
        """Note that a frame is sent."""
        self._under_way.append(_Sent(number, self._clock(), len(self._under_way) + 1))

    def drawn(self, number: int) -> None:
        """Note that a frame, and all before it, have been drawn."""
        now = self._clock()
        while self._under_way and self._under_way[0].number <= number:
            sent = self._under_way.popleft()
            if sent.number == number:
                self._learn(sent.together, now - sent.at, now)

    def _learn(self, count: int, took: float, now: float) -> None:
        if count == 1 or took < self._alone:
            self._alone, self._measured_at = took, now
        wanted = count * self._alone / max(took, self._alone) + _WAITING
        self._limit = min(max(self._limit + _STEP * (wanted - self._limit), 1.0), MOST)
