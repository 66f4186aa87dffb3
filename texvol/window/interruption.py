"""Ctrl-C, heard where nothing is left half done.

Python raises KeyboardInterrupt wherever it happens to be. Inside a library that is just being loaded that ends the
process on the spot (an exception may not pass through its C++), inside a callback of the window it is swallowed, and
between a process' start and the note of it the process is forgotten. So it is only noted, and raised by `check`.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any


class Interruption:
    """While this context lasts, Ctrl-C is noted; `check` raises KeyboardInterrupt for it."""

    def __init__(self) -> None:
        self.came = False
        self._before: Any = None

    def __enter__(self) -> Interruption:
        if threading.current_thread() is threading.main_thread():  # no other can hear signals
            self._before = signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)
        if kind is None:
            self.check()

    def check(self) -> None:
        """Where it is safe to end."""
        if self.came:
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.came = True
