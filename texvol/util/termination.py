"""SIGTERM and SIGHUP end a command as ctrl-C does: by an exception, so that nothing half written stays behind.

Unheard they end the process on the spot, with the files that it writes beside their places left there.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGTERM, signal.SIGHUP)


class Terminated(BaseException):
    """One of `SIGNALS` came; like KeyboardInterrupt no Exception, so that nobody takes it for a failure of theirs."""

    def __init__(self, number: int) -> None:
        super().__init__(f"ended by {signal.Signals(number).name}")
        self.status = 128 + number  # as a shell has it


@contextmanager
def heard() -> Iterator[None]:
    """While this context lasts, each of `SIGNALS` raises Terminated; where it is ignored (nohup), it stays so."""
    ours = []
    if threading.current_thread() is threading.main_thread():  # no other can hear signals
        ours = [each for each in SIGNALS if signal.getsignal(each) is signal.SIG_DFL]
    try:
        for each in ours:
            signal.signal(each, _raise)
        yield
    finally:
        for each in ours:
            signal.signal(each, signal.SIG_DFL)


def _raise(number: int, frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_DFL)  # a second one ends us at once, whatever is being cleared away
    raise Terminated(number)
