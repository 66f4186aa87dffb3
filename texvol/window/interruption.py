"""Ctrl-C, SIGTERM and SIGHUP, heard where nothing is left half done.

Python raises KeyboardInterrupt, and `termination` its own, wherever it happens to be. Inside a library that is just
being loaded that ends the process on the spot (an exception may not pass through its C++), inside a callback of the
window it is swallowed, and between a process' start and the note of it the process is forgotten. So it is only noted,
and raised by `check`.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any

from texvol.util import termination


class Interruption:
    """While this context lasts, the signal is noted; `check` raises KeyboardInterrupt or Terminated for it."""

    def __init__(self) -> None:
        self.came = 0
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Interruption:
        if threading.current_thread() is threading.main_thread():  # no other can hear signals
            for each in (signal.SIGINT, *termination.SIGNALS):
                if each == signal.SIGINT or signal.getsignal(each) is not signal.SIG_IGN:  # as under nohup
                    self._before[each] = signal.signal(each, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for each, before in self._before.items():
            signal.signal(each, before)
        if kind is None:
            self.check()

    def check(self) -> None:
        """Where it is safe to end."""
        if self.came == signal.SIGINT:
            raise KeyboardInterrupt
        if self.came:
            raise termination.Terminated(self.came)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.came = number
