"""Estimate of the time that is left of some work, from the fractions of it that are done."""

from __future__ import annotations

from collections import deque

_ENOUGH = 1.0  # seconds: from less, the speed is not known
_REMEMBERED = 60  # fractions: the speed is that of the last of them,
_LEAST = 0.1  # which are this much of the work at least: a fraction that hardly grows for a while would take for ever


class TimeLeft:
    """Estimate by the speed of the last steps; the time before the first fraction, of setting up, does not count."""

    def __init__(self) -> None:
        self._known: deque[tuple[float, float]] = deque()  # time and fraction, ascending

    def learn(self, fraction: float, now: float) -> None:
        """Record that a fraction, from 0 to 1, is done at a time in seconds; a smaller one begins other work."""
        if self._known and fraction < self._known[-1][1]:
            self._known.clear()
        if not self._known or fraction > self._known[-1][1]:
            self._known.append((now, fraction))
        while len(self._known) > _REMEMBERED and self._known[1][1] <= fraction - _LEAST:
            self._known.popleft()

    def seconds(self, now: float) -> float | None:
        """Return the seconds that are left; None as long as the speed is not known."""
        if len(self._known) < 2:
            return None
        (start, before), (end, done) = self._known[0], self._known[-1]
        if end - start < _ENOUGH:
            return None
        left = (1 - done) * (end - start) / (done - before)
        return max(left - (now - end), 0.0)

    def text(self, now: float) -> str:
        """Return such as "12 s left"; "" as long as the speed is not known."""
        left = self.seconds(now)
        return "" if left is None else f"{duration(left)} left"


def duration(seconds: float) -> str:
    """Return a duration in words, such as "12 s", "3 min" and "2 h 5 min"."""
    whole = max(round(seconds), 1)
    if whole < 100:
        return f"{whole} s"
    minutes = round(whole / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"
