"""State of what moves the camera beside mouse and keys: motions, orientation cube, saved views and their pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from texvol.scene.camera import Camera
from texvol.scene.orbit import Turn
from texvol.util.time_left import TimeLeft
from texvol.window.document import Document
from texvol.window.navigation import View
from texvol.window.thumbnails import Thumbnails


@dataclass
class Motion:
    """Move of the camera.

    Attributes
    ----------
    at : callable
        Returns the view at a number of seconds after the start.
    seconds : float
        Duration; a move that `repeats` begins again then.
    end : callable
        Called at the end, unless another change of the view ends the move earlier.
    name : str
        What the move is, for its button; "" for a move to another view.
    start : float, optional
        Time of the first frame.
    last : Camera, optional
        Camera that the move has set last.
    """

    document: Document
    at: Callable[[float], View]
    seconds: float
    end: Callable[[], Any] = lambda: None
    name: str = ""
    repeats: bool = False
    start: float | None = None
    last: Camera | None = None


@dataclass
class Moving:
    """State of what moves the camera.

    Attributes
    ----------
    motion : Motion, optional
        Move that goes on.
    cube : bool
        True if the orientation cube is shown.
    pressed : (x, y), optional
        Where the mouse was pressed on the cube, in window coordinates.
    dragged : bool
        True if the mouse has moved since, so that its release is no click.
    turn : Turn
        Turn of films and previews.
    films_tour : bool
        True if films go through the saved views, False if they turn.
    film_error : float
        Error that the first picture of a film may have, from 0 to 1.
    forecasts : dict
        Seconds that films are expected to take, by their paths.
    left : TimeLeft
        Estimate of the time that is left of writing a file.
    """

    motion: Motion | None = None
    cube: bool = True
    pressed: tuple[float, float] | None = None
    dragged: bool = False
    turn: Turn = field(default_factory=Turn)
    films_tour: bool = False
    film_error: float = 4 / 255  # no longer seen in a film that is compressed
    thumbnails: Thumbnails = field(default_factory=Thumbnails)
    forecasts: dict[str, float] = field(default_factory=dict)
    left: TimeLeft = field(default_factory=TimeLeft)
