"""SIGTERM and SIGHUP raise an exception, as ctrl-C does, so that temporary files are removed before a command ends."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGTERM, signal.SIGHUP)


class Terminated(BaseException):
    """One of `SIGNALS` arrived; not an Exception, like KeyboardInterrupt, so that `except Exception` passes it on."""

    def __init__(self, number: int) -> None:
        super().__init__(f"ended by {signal.Signals(number).name}")
        self.status = 128 + number  # exit status as of a shell


@contextmanager
def heard() -> Iterator[None]:
    """Raise Terminated on `SIGNALS` within this context; ignored signals (nohup) stay ignored."""
    ours = []
    if threading.current_thread() is threading.main_thread():  # Python handles signals there only
        ours = [each for each in SIGNALS if signal.getsignal(each) is signal.SIG_DFL]
    try:
        for each in ours:
            signal.signal(each, _raise)
        yield
    finally:
        for each in ours:
            signal.signal(each, signal.SIG_DFL)


def _raise(number: int, frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_DFL)  # a second signal ends the process at once
    raise Terminated(number)
