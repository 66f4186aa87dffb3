"""Limit of the seconds that a verdict may take: those of the oracle's pictures and of the mistakes that are drawn."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

from texvol.util import terminal
from texvol.util.errors import TexvolError


class TooSlow(TexvolError):
    """A picture would take longer than the limit; the message says how long."""


class Patience:
    """Seconds that may still be spent, shared by all pictures of a comparison.

    Parameters
    ----------
    limit : float, optional
        Seconds; None for no limit.
    now : callable
        Clock, in seconds.
    """

    def __init__(self, limit: float | None = None, now: Callable[[], float] = monotonic) -> None:
        self._limit, self._now = limit, now
        self._spent = 0.0

    def of_oracle(self, role: str) -> Callable[[float], None]:
        """Return the function that is told what fraction of an oracle's picture is done.

        Time counts from the first call, since the oracle may be compiled before.

        Raises
        ------
        TooSlow
            By the returned function, if what is left of the picture would take longer than what is left of the limit.
        """
        terminal.stage(f"ray casting the scene of the {role}")
        start, before, told = None, self._spent, 0.0

        def tell(fraction: float) -> None:
            nonlocal start, told
            terminal.done(fraction)
            if start is None:
                start, told = self._now(), fraction
                return
            seconds = self._now() - start
            self._spent = before + seconds
            if fraction <= told or self._limit is None:
                return
            left = seconds * (1 - fraction) / (fraction - told)
            if self._spent + left > self._limit:
                raise TooSlow(f"its picture would take about {seconds + left:.0f} s longer; --oracle waits for it")

        return tell

    def of_mistakes(self) -> Callable[[int, int], bool]:
        """Return the function that is told how many of so many pictures are drawn; True if the next takes too long.

        The next is expected to take as long as the last.
        """
        terminal.stage("drawing the usual mistakes of renderers")
        last = self._now()

        def is_over(drawn: int, pictures: int) -> bool:
            nonlocal last
            terminal.done(drawn / pictures)
            now = self._now()
            seconds, last = now - last, now
            self._spent += seconds
            return self._limit is not None and self._spent + seconds > self._limit

        return is_over
