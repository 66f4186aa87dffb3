"""From events over the picture to moves of the view, and to commands; the table of keys is what F1 shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from texvol.scene.volume import Volume
from texvol.window import navigation
from texvol.window.events import Event
from texvol.window.navigation import Position, View

_STEP = np.radians(5)  # of a key
_DOUBLE = 0.35, 4.0  # seconds and window coordinates within which two clicks are a double one
_WHEEL = 1.15  # factor of the distance for one notch
_ADVANCE = 0.06  # radii of the box for one notch, or one key


class Binding(NamedTuple):
    """A key that does something: `chord` is modifiers in alphabetical order and the key, as "ctrl+s"."""

    chords: tuple[str, ...]
    command: str
    text: str


BINDINGS = (
    Binding(("f1", "shift+slash", "slash"), "help", "show or hide this page"),
    Binding(("tab",), "panels", "hide or show everything but the picture"),
    Binding(("r", "home"), "reset", "the view of `texvol render`"),
    Binding(("f",), "frame", "the whole volume, from here"),
    Binding(("o",), "projection", "orthographic or perspective"),
    Binding(("t",), "turning", "turn as on a turntable, or freely"),
    Binding(("x", "shift+x"), "axis x", "look from +x, with shift from -x"),
    Binding(("y", "shift+y"), "axis y", "look from +y, or -y"),
    Binding(("z", "shift+z"), "axis z", "look from +z, or -z"),
    Binding(("left", "right", "up", "down"), "", "turn; with shift move"),
    Binding(("page_up", "page_down"), "", "nearer, farther"),
    Binding(("w", "s"), "", "into the volume, and out of it"),
    Binding(("q", "e"), "", "roll"),
    Binding(("left_bracket", "right_bracket"), "", "smaller or larger field of view"),
    Binding(("ctrl+z",), "undo", "undo"),
    Binding(("ctrl+shift+z", "ctrl+y"), "redo", "redo"),
    Binding(("ctrl+o",), "open", "open a volume or a scene"),
    Binding(("ctrl+shift+o",), "add", "add a volume or a mesh to the scene"),
    Binding(("ctrl+s",), "save", "save the scene"),
    Binding(("p", "f12"), "picture", "save the picture"),
    Binding(("ctrl+c",), "copy", "copy the command line of this picture"),
    Binding(("i",), "probe", "value and extinction under the cursor"),
    Binding(("l",), "slices", "slices beside the picture"),
    Binding(("f11",), "fullscreen", "fill the screen"),
    Binding(("ctrl+q",), "close", "close the window"),
)
MOUSE = (
    ("left", "turn"),
    ("shift + left, or middle", "move"),
    ("ctrl + left", "roll"),
    ("right, or wheel", "nearer, farther (wheel: at the cursor)"),
    ("shift + wheel", "into the volume, and through it"),
    ("ctrl + wheel", "field of view"),
    ("double click", "turn about what is there"),
)
_COMMANDS = {chord: binding.command for binding in BINDINGS for chord in binding.chords if binding.command}


@dataclass(frozen=True)
class Room:
    """Where the picture is in the window: upper left corner and size, in window coordinates."""

    x: float
    y: float
    width: float
    height: float

    def holds(self, x: float, y: float) -> bool:
        """Whether a place of the window is in it."""
        return 0 <= x - self.x < self.width and 0 <= y - self.y < self.height

    def position(self, x: float, y: float) -> Position:
        """In half heights from the middle, y upwards."""
        half = max(self.height, 1) / 2
        return (x - self.x - self.width / 2) / half, (self.height / 2 - (y - self.y)) / half

    @property
    def aspect(self) -> float:
        """Width over height."""
        return max(self.width, 1) / max(self.height, 1)


@dataclass
class Outcome:
    """What some events amount to.

    Attributes
    ----------
    view : View
    commands : list of str
        In their order.
    clicked : (x, y), optional
        Where a double click was, in window coordinates.
    """

    view: View
    commands: list[str]
    clicked: tuple[float, float] | None = None


class Steering:
    """What the hand is doing: which button it holds, and where it was."""

    def __init__(self) -> None:
        self.free = False
        self._at = (0.0, 0.0)
        self._drag: str | None = None
        self._button = ""
        self._last_click: tuple[float, float, float] | None = None

    @property
    def dragging(self) -> bool:
        """Whether a drag over the picture goes on."""
        return self._drag is not None

    @property
    def cursor(self) -> tuple[float, float]:
        """Where the mouse is, in window coordinates."""
        return self._at

    def handle(
        self, events: list[Event], view: View, volume: Volume, room: Room, now: float,
        *, mouse: bool = True, keyboard: bool = True,
    ) -> Outcome:  # fmt: skip
        """What the events do to the view; `mouse` and `keyboard`: whether they are ours, or the panels'."""
        outcome = Outcome(view, [])
        for event in events:
            if event.kind == "move":
                self._move(event, outcome, volume, room)
            elif event.kind == "button":
                self._press(event, outcome, room, now, mouse)
            elif event.kind == "scroll" and mouse and room.holds(*self._at):
                outcome.view = self._scrolled(event, outcome.view, volume, room)
            elif event.kind == "key" and event.down and keyboard:
                self._key(event, outcome, volume)
            elif event.kind == "focus" and not event.down:
                self._drag = None  # the button may come up elsewhere
        return outcome

    def _move(self, event: Event, outcome: Outcome, volume: Volume, room: Room) -> None:
        before, after = room.position(*self._at), room.position(event.x, event.y)
        self._at = event.x, event.y
        right, up = after[0] - before[0], after[1] - before[1]
        view = outcome.view
        if self._drag == "turn":
            # The height of the picture is half a turn.
            outcome.view = navigation.orbit(view, right * np.pi / 2, up * np.pi / 2, free=self.free)
        elif self._drag == "move":
            outcome.view = navigation.pan(view, right, up)
        elif self._drag == "dolly":
            outcome.view = navigation.dolly(view, float(np.exp(-1.5 * up)), (0.0, 0.0), volume)
        elif self._drag == "roll":
            turned = np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0])
            outcome.view = navigation.roll(view, float((turned + np.pi) % (2 * np.pi) - np.pi))

    def _press(self, event: Event, outcome: Outcome, room: Room, now: float, mouse: bool) -> None:
        if not event.down:
            if event.name == self._button:
                self._drag = None
            return
        if not mouse or not room.holds(*self._at) or self._drag:
            return
        kinds = {"right": "dolly", "middle": "move"}
        if event.name == "left":
            kinds["left"] = "move" if "shift" in event.modifiers else "roll" if "ctrl" in event.modifiers else "turn"
        self._drag, self._button = kinds[event.name], event.name
        if event.name == "left":
            last, self._last_click = self._last_click, (now, *self._at)
            if (
                last
                and now - last[0] < _DOUBLE[0]
                and np.hypot(last[1] - self._at[0], last[2] - self._at[1]) < _DOUBLE[1]
            ):
                outcome.clicked, self._last_click = self._at, None

    def _scrolled(self, event: Event, view: View, volume: Volume, room: Room) -> View:
        if "shift" in event.modifiers:
            return navigation.advance(view, _ADVANCE * (event.y or event.x), volume)
        if "ctrl" in event.modifiers:
            return navigation.with_fov(view, view.camera.fov * 1.05**-event.y)
        return navigation.dolly(view, _WHEEL**-event.y, room.position(*self._at), volume)

    def _key(self, event: Event, outcome: Outcome, volume: Volume) -> None:
        chord = "+".join([*sorted(event.modifiers), event.name])
        if chord in _COMMANDS:
            command = _COMMANDS[chord]
            if command.startswith("axis"):
                command = f"axis {'-' if 'shift' in event.modifiers else '+'}{event.name}"
            outcome.commands.append(command)
        elif chord in _MOVES:
            outcome.view = _MOVES[chord](outcome.view, volume, self.free)


def _turn(right: float, up: float) -> Callable[[View, Volume, bool], View]:
    return lambda view, volume, free: navigation.orbit(view, right * _STEP, up * _STEP, free=free)


def _pan(right: float, up: float) -> Callable[[View, Volume, bool], View]:
    return lambda view, volume, free: navigation.pan(view, 0.1 * right, 0.1 * up)


def _wider(factor: float) -> Callable[[View, Volume, bool], View]:
    return lambda view, volume, free: navigation.with_fov(view, view.camera.fov * factor)


_MOVES: dict[str, Callable[[View, Volume, bool], View]] = {
    "left": _turn(-1, 0), "right": _turn(1, 0), "up": _turn(0, 1), "down": _turn(0, -1),
    "shift+left": _pan(-1, 0), "shift+right": _pan(1, 0), "shift+up": _pan(0, 1), "shift+down": _pan(0, -1),
    "page_up": lambda view, volume, free: navigation.dolly(view, 1 / _WHEEL, (0.0, 0.0), volume),
    "page_down": lambda view, volume, free: navigation.dolly(view, _WHEEL, (0.0, 0.0), volume),
    "w": lambda view, volume, free: navigation.advance(view, _ADVANCE, volume),
    "s": lambda view, volume, free: navigation.advance(view, -_ADVANCE, volume),
    "q": lambda view, volume, free: navigation.roll(view, -_STEP),
    "e": lambda view, volume, free: navigation.roll(view, _STEP),
    "left_bracket": _wider(1 / 1.1), "right_bracket": _wider(1.1),
}  # fmt: skip
