"""Progress of long work: the code that does it tells how far it is, and can be ended there.

Work is counted in the seconds that it takes on a usual machine, so that fractions of it are fractions of time on others
as well. A fraction never falls: if there is more to do than was expected, it waits.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# Beyond this fraction of what was expected, progress slows down, and comes to an end only when the work does.
_CERTAIN = 0.9

Hear = Callable[[float], None]
Seconds = float | Callable[[], float]  # a function is called only if the progress is heard: a forecast takes time


class _Work:
    """Work whose progress is heard."""

    def __init__(self, hear: Hear, expected: float) -> None:
        self._hear, self._expected = hear, expected
        self._low, self._high = 0.0, 1.0  # fractions at the begin and the end of the current span
        self._done = self._shown = 0.0
        self._part: tuple[float, float, int] | None = None  # seconds done before it, its seconds, its pieces
        self._pieces = 0.0  # of it that are done

    def tell(self) -> None:
        """Let the listener hear the fraction; it may raise an exception that ends the work."""
        if self._expected > 0:
            fraction = _slowed(self._done / self._expected)
            self._shown = max(self._shown, self._low + fraction * (self._high - self._low))
        self._hear(self._shown)

    def expect(self, seconds: float) -> None:
        """Expect so much more work from here on, in the rest of the span."""
        self._low, self._done, self._expected = self._shown, 0.0, seconds

    def advance(self, seconds: float) -> None:
        """Count work that is done."""
        self._done += seconds
        self.tell()

    @contextmanager
    def span(self, share: float, seconds: float) -> Iterator[None]:
        """Give the work inside a share of what is left of the span around it."""
        outer, end = self._high, self._shown + share * (self._high - self._shown)
        self._high = end
        self.expect(seconds)
        yield
        self._shown, self._high = max(self._shown, end), outer
        self.expect(0.0)

    def begin(self, seconds: float, pieces: int) -> None:
        """Begin a part of the work."""
        self._part, self._pieces = (self._done, seconds, max(pieces, 1)), 0.0

    def within(self, fraction: float) -> None:
        """Count a further fraction of a piece."""
        if self._part is not None:
            before, seconds, pieces = self._part
            self._pieces += fraction
            self._done = before + seconds * min(self._pieces / pieces, 1.0)
        self.tell()

    def end(self) -> None:
        """End the part: all of it is done."""
        if self._part is not None:
            self._done = self._part[0] + self._part[1]
        self._part = None


def _slowed(done: float) -> float:
    """Return the fraction that is shown of work of which so much is done, relative to what was expected."""
    left = 1 - _CERTAIN
    return done if done <= _CERTAIN else 1 - left / (1 + (done - _CERTAIN) / left)


class _Current(threading.local):
    """Work of the thread; other threads that help with it tell nothing."""

    work: _Work | None = None


_current = _Current()


@contextmanager
def heard(hear: Hear, expected: float = 0.0) -> Iterator[None]:
    """Let `hear` be called on this thread with the fraction that is done, from 0 to 1, as often as the work tells it.

    Parameters
    ----------
    hear : callable
        An exception that it raises ends the work.
    expected : float
        Seconds that all of it takes on a usual machine.
    """
    before, _current.work = _current.work, _Work(hear, expected)
    try:
        yield
    finally:
        _current.work = before


def _number(seconds: Seconds) -> float:
    return seconds() if callable(seconds) else seconds


def is_heard() -> bool:
    """True if anybody hears the progress."""
    return _current.work is not None


def expect(seconds: Seconds) -> None:
    """Expect so many seconds of work from here on, in place of what was expected before."""
    if _current.work is not None:
        _current.work.expect(_number(seconds))


def advance(seconds: float) -> None:
    """Tell that work of so many seconds is done."""
    if _current.work is not None:
        _current.work.advance(seconds)


@contextmanager
def span(share: float, seconds: Seconds) -> Iterator[None]:
    """Give the work inside, of about so many seconds, a share of the progress that is left; then expect anew."""
    if _current.work is None:
        yield
        return
    with _current.work.span(share, _number(seconds)):
        yield


@contextmanager
def part(seconds: Seconds, pieces: int = 1) -> Iterator[None]:
    """Do a part of the work of so many seconds, in pieces of the same length, each told by `within`."""
    work = _current.work
    if work is None:
        yield
        return
    work.begin(_number(seconds), pieces)
    yield
    work.end()


def within(fraction: float) -> None:
    """Tell that a further fraction of a piece of the part is done."""
    if _current.work is not None:
        _current.work.within(fraction)
