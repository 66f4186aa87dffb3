"""Ctrl-C, SIGTERM and SIGHUP, handled at points where nothing is left half done.

Python raises KeyboardInterrupt at any bytecode. During the import of a C++ library the exception ends the process at
once; in a callback of GLFW it is lost; between the start of a child process and the assignment of its handle, the child
is never ended. So the signal handler only records the signal, and `check` raises the exception.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any

from texvol.util import termination


class Interruption:
    """Context manager that records signals; `check` raises KeyboardInterrupt or Terminated for them."""

    def __init__(self) -> None:
        self.received = 0
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Interruption:
        if threading.current_thread() is threading.main_thread():  # Python handles signals on this thread only
            for each in (signal.SIGINT, *termination.SIGNALS):
                if each == signal.SIGINT or signal.getsignal(each) is not signal.SIG_IGN:  # ignored under nohup
                    self._before[each] = signal.signal(each, self._note)
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        for each, before in self._before.items():
            signal.signal(each, before)
        if kind is None:
            self.check()

    def check(self) -> None:
        """Raise the exception of a recorded signal."""
        if self.received == signal.SIGINT:
            raise KeyboardInterrupt
        if self.received:
            raise termination.Terminated(self.received)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.received = number
