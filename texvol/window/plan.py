"""Plan of one run of the window: what is opened, how large, and how it ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from texvol.window.document import Document
from texvol.window.events import Event
from texvol.window.home import Home
from texvol.window.quality import DEFAULT_ERROR, DEFAULT_FRAMES_PER_SECOND
from texvol.window.screen import Screen
from texvol.window.script import Player


@dataclass(frozen=True)
class Plan:
    """Settings of one run of the window.

    Attributes
    ----------
    size : (width, height)
        Size of the picture in window coordinates.
    is_usual_size : bool
        True if nobody chose the size: on a scaled monitor the picture is as many times larger.
    open : callable, optional
        Returns the first document; its argument is the picture's size in pixels. `name` is the name of its file.
    frames : int, optional
        Number of frames after which the window closes, counted from the first picture on. With `screenshot`, the last
        frame waits until the picture is at rest.
    screenshot, timings, record : str, optional
        Files to write: a screenshot at the end, the table of frame times, the recorded input.
    home : callable
        Makes the screen of the window from its size, its title, and the receiver of its events.
    begun : callable
        Called once: with the first document when it is open, or with None if there is none.
    check : callable
        Called once in each frame; an exception that it raises ends the window.
    device : int or str, optional
        Device that pictures are drawn on, as for `Renderer`.
    shows_empty : bool
        False: frames before the first picture are not shown.
    """

    size: tuple[int, int]
    is_usual_size: bool = False
    open: Callable[[tuple[int, int]], Document] | None = None
    name: str = ""
    panels: bool = True
    frames: int | None = None
    screenshot: str | None = None
    timings: str | None = None
    record: str | None = None
    player: Player | None = None
    frames_per_second: float = DEFAULT_FRAMES_PER_SECOND
    max_error: float = DEFAULT_ERROR
    slicing: str = "stacks"
    home: Callable[[tuple[int, int], str, Callable[[Event], int]], Home] = Screen
    begun: Callable[[Document | None], None] = lambda _: None
    check: Callable[[], None] = lambda: None
    device: int | str | None = None
    shows_empty: bool = True

    @property
    def ends(self) -> bool:
        """True if the window closes by itself after the script has been played and the picture is at rest."""
        return self.frames is None and (self.player is not None or self.screenshot is not None)

    def window_size(self, beside: float, scale: float = 1.0) -> tuple[int, int]:
        """Return the size of the window on a monitor of that scale, with panels that are `beside` wide at scale 1."""
        larger = scale if self.is_usual_size else 1.0
        panels_width = round(beside * scale) if self.panels else 0
        return round(self.size[0] * larger) + panels_width, round(self.size[1] * larger)
