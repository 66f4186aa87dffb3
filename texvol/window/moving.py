"""State of what moves the camera beside mouse and keys: motions, orientation cube, saved views and their pictures."""

from __future__ import annotations

from dataclasses import dataclass, field

from texvol.scene.orbit import Turn
from texvol.util.time_left import TimeLeft
from texvol.window.motion import Motion
from texvol.window.thumbnails import Thumbnails


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
    left : TimeLeft
        Estimate of the time that is left of writing a file.
    """

    motion: Motion | None = None
    cube: bool = True
    pressed: tuple[float, float] | None = None
    dragged: bool = False
    turn: Turn = field(default_factory=Turn)
    films_tour: bool = False
    thumbnails: Thumbnails = field(default_factory=Thumbnails)
    left: TimeLeft = field(default_factory=TimeLeft)
