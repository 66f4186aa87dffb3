"""Newest frame and waiting events, between the thread that draws the window and the threads of its viewers."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from texvol.window.events import Event

MOST_EVENTS = 4096  # that wait; nobody's hands are so fast
LEAST_SIDE, MOST_SIDE, MOST_PIXELS, MOST_SCALE = 64, 4096, 1 << 23, 4.0


@dataclass(frozen=True)
class Frame:
    """Picture of the window, and what belongs to it.

    Attributes
    ----------
    pixels : bytes
        RGB, 8 bits, bottom row first, of `size` (width, height).
    cursor, title : str
        Kind of the mouse cursor, and text of the title bar.
    typing : bool
        True while letters would go to a text field.
    copied : (int, str)
        Text that was copied last, with its number.
    """

    pixels: bytes = b""
    size: tuple[int, int] = (0, 0)
    cursor: str = ""
    title: str = ""
    typing: bool = False
    copied: tuple[int, str] = (0, "")


class Exchange:
    """Meeting place of one window and its viewers; every method may be called on any thread.

    `changed` is notified when a frame, an event or a viewer has come.
    """

    def __init__(self, most_viewers: int = 1) -> None:
        self.changed = threading.Condition()
        self.frame, self.version, self.changed_at = Frame(), 0, 0.0
        self.ended = False  # the window is closed
        self.pasted = ""
        self._most_viewers = most_viewers
        self._viewers: list[Any] = []
        self._sizes: dict[Any, tuple[int, int, float]] = {}
        self._events: deque[Event] = deque()
        self._woken = False

    @property
    def watched(self) -> bool:
        """True if somebody looks."""
        return bool(self._viewers)

    @property
    def wanted(self) -> tuple[int, int, float] | None:
        """Width, height and scale that the viewer who came first asks for."""
        with self.changed:
            return next((self._sizes[each] for each in self._viewers if each in self._sizes), None)

    @contextmanager
    def viewed(self, viewer: Any) -> Iterator[bool]:
        """Take part as a viewer; the value is False if there are as many viewers as may be, or the window is closed."""
        with self.changed:
            welcome = len(self._viewers) < self._most_viewers and not self.ended
            if welcome:
                self._viewers.append(viewer)
        try:
            self.wake()
            yield welcome
        finally:
            with self.changed:
                if welcome:
                    self._viewers.remove(viewer)
                    self._sizes.pop(viewer, None)
            self.wake()

    def ask_size(self, viewer: Any, size: tuple[int, int, float]) -> None:
        """Ask for a size in pixels and a scale, which are brought within limits."""
        width, height = (min(max(round(side), LEAST_SIDE), MOST_SIDE) for side in size[:2])
        height = min(height, MOST_PIXELS // width)
        with self.changed:
            self._sizes[viewer] = width, height, min(max(size[2], 1.0), MOST_SCALE)
        self.wake()

    def put(self, events: list[Event]) -> bool:
        """Add events; return False, and add none, if too many wait."""
        with self.changed:
            if len(self._events) + len(events) > MOST_EVENTS:
                return False
            self._events.extend(events)
            self.changed.notify_all()
        return True

    def wake(self) -> None:
        """End the window's `wait` early."""
        with self.changed:
            self._woken = True
            self.changed.notify_all()

    def wait(self, seconds: float, most: int = MOST_EVENTS) -> list[Event]:
        """Return the events that came, at most so many, and wait for one for at most `seconds`."""
        end = time.monotonic() + seconds
        with self.changed:
            while not self._events and not self._woken and (left := end - time.monotonic()) > 0:
                self.changed.wait(left)
            self._woken = False
            return [self._events.popleft() for _ in range(min(len(self._events), most))]

    def show(self, **changes: Any) -> None:
        """Replace parts of the frame; the same again is no new frame."""
        with self.changed:
            if changes.get("pixels") == self.frame.pixels:
                changes["pixels"] = self.frame.pixels  # viewers compare which object it is
            frame = replace(self.frame, **changes)
            if frame != self.frame:
                self.frame, self.version, self.changed_at = frame, self.version + 1, time.monotonic()
                self.changed.notify_all()

    def end(self) -> None:
        """Send the viewers away."""
        with self.changed:
            self.ended = True
            self.changed.notify_all()
