"""Conversion of events over the picture to camera moves and commands; the table of keys is shown by F1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from texvol.scene.volume import Volume
from texvol.window import navigation
from texvol.window.events import Event
from texvol.window.navigation import Position, View

_STEP = np.radians(5)  # of one key press
_DOUBLE = 0.35, 4.0  # largest time (s) and distance (window coordinates) between the clicks of a double click
_WHEEL = 1.15  # factor of the distance for one notch of the wheel
_ADVANCE = 0.06  # radii of the box for one notch or one key press


class Binding(NamedTuple):
    """Keys of a command. A chord is the modifiers in alphabetical order and the key, such as "ctrl+s"."""

    chords: tuple[str, ...]
    command: str
    text: str


BINDINGS = (
    Binding(("f1", "shift+slash", "slash"), "help", "show or hide this page"),
    Binding(("tab",), "panels", "show or hide the panels"),
    Binding(("r", "home"), "reset", "reset to the view of texvol render"),
    Binding(("f",), "frame", "show the whole volume from this direction"),
    Binding(("o",), "projection", "orthographic or perspective"),
    Binding(("t",), "turning", "turn on a turntable or freely"),
    Binding(("x", "shift+x"), "axis x", "look from +x; with shift, from -x"),
    Binding(("y", "shift+y"), "axis y", "look from +y; with shift, from -y"),
    Binding(("z", "shift+z"), "axis z", "look from +z; with shift, from -z"),
    Binding(("v",), "save-view", "save this view"),
    Binding(("left", "right", "up", "down"), "", "turn; with shift, move"),
    Binding(("page_up", "page_down"), "", "go nearer; go farther"),
    Binding(("w", "s"), "", "go into the volume; go back"),
    Binding(("q", "e"), "", "roll"),
    Binding(("left_bracket", "right_bracket"), "", "narrower or wider field of view"),
    Binding(("ctrl+z",), "undo", "undo"),
    Binding(("ctrl+shift+z", "ctrl+y"), "redo", "redo"),
    Binding(("alt+left",), "back", "return to the scene before this one"),
    Binding(("alt+right",), "forward", "return to the scene after this one"),
    Binding(("ctrl+o",), "open", "open a volume or a scene"),
    Binding(("ctrl+shift+o",), "add", "add a volume or a mesh to the scene"),
    Binding(("ctrl+s",), "save", "save the scene"),
    Binding(("p", "f12"), "picture", "save the picture"),
    Binding(("space",), "play", "play the time steps; pause"),
    Binding(("comma",), "step -1", "the time step before"),
    Binding(("period",), "step +1", "the time step after"),
    Binding(("ctrl+c",), "copy", "copy the picture"),
    Binding(("ctrl+shift+c",), "copy-command", "copy the command line of this picture"),
    Binding(("i",), "probe", "show value and extinction at the cursor"),
    Binding(("l",), "slices", "show slices"),
    Binding(("g",), "layout", "slices beside the 3D view, or the 3D view alone"),
    Binding(("m",), "tab Measure", "measure lengths, angles, boxes and profiles"),
    Binding(("delete",), "measure delete", "remove the selected measure"),
    Binding(("ctrl+m",), "measure copy", "copy all measures as CSV"),
    Binding(("f11",), "fullscreen", "fill the screen"),
    Binding(("ctrl+q",), "close", "close the window"),
)
MOUSE = (
    ("left", "turn"),
    ("shift + left, or middle", "move"),
    ("ctrl + left", "roll"),
    ("right, or wheel", "go nearer or farther (wheel: at the cursor)"),
    ("shift + wheel", "go into the volume and through it"),
    ("ctrl + wheel", "field of view"),
    ("double click", "turn about the clicked point"),
)
_COMMANDS = {chord: binding.command for binding in BINDINGS for chord in binding.chords if binding.command}


@dataclass(frozen=True)
class Viewport:
    """Rectangle of the picture in the window: upper left corner and size, in window coordinates."""

    x: float
    y: float
    width: float
    height: float

    def holds(self, x: float, y: float) -> bool:
        """True if a point of the window lies in the rectangle."""
        return 0 <= x - self.x < self.width and 0 <= y - self.y < self.height

    def position(self, x: float, y: float) -> Position:
        """Return the position of a point of the window, in half heights from the picture's centre, y upwards."""
        half = max(self.height, 1) / 2
        return (x - self.x - self.width / 2) / half, (self.height / 2 - (y - self.y)) / half

    def point(self, position: Position) -> tuple[float, float]:
        """Return the point of the window at a position in the picture; the inverse of `position`."""
        half = self.height / 2
        return self.x + self.width / 2 + position[0] * half, self.y + half - position[1] * half

    @property
    def aspect(self) -> float:
        """Width divided by height."""
        return max(self.width, 1) / max(self.height, 1)


@dataclass
class Outcome:
    """Result of some events.

    Attributes
    ----------
    view : View
        View after the events.
    commands : list of str
        Commands of pressed keys, in order.
    clicked : (x, y), optional
        Position of a double click in window coordinates.
    """

    view: View
    commands: list[str]
    clicked: tuple[float, float] | None = None


class Steering:
    """Mouse state between events: position, pressed button and drag."""

    def __init__(self) -> None:
        self.free = False
        self.cursor = (0.0, 0.0)  # window coordinates
        self._drag: str | None = None
        self._button = ""
        self._last_click: tuple[float, float, float] | None = None

    @property
    def dragging(self) -> bool:
        """True during a drag that began over the picture."""
        return self._drag is not None

    def handle(
        self, events: list[Event], view: View, volume: Volume, viewport: Viewport, now: float,
        *, mouse: bool = True, keyboard: bool = True,
    ) -> Outcome:  # fmt: skip
        """Apply events to a view; `mouse` and `keyboard` are False while the panels use them."""
        outcome = Outcome(view, [])
        for event in events:
            if event.kind == "move":
                self._move(event, outcome, volume, viewport)
            elif event.kind == "button":
                self._press(event, outcome, viewport, now, mouse)
            elif event.kind == "scroll" and mouse and viewport.holds(*self.cursor):
                outcome.view = self._scrolled(event, outcome.view, volume, viewport)
            elif event.kind == "key" and event.down and keyboard:
                self._key(event, outcome, volume)
            elif event.kind == "focus" and not event.down:
                self._drag = None  # the button may be released in another window
        return outcome

    def _move(self, event: Event, outcome: Outcome, volume: Volume, viewport: Viewport) -> None:
        before, after = viewport.position(*self.cursor), viewport.position(event.x, event.y)
        self.cursor = event.x, event.y
        right, up = after[0] - before[0], after[1] - before[1]
        view = outcome.view
        if self._drag == "turn":
            # A drag over the height of the picture turns by 180 degrees.
            outcome.view = navigation.orbit(view, right * np.pi / 2, up * np.pi / 2, free=self.free)
        elif self._drag == "move":
            outcome.view = navigation.pan(view, right, up)
        elif self._drag == "dolly":
            outcome.view = navigation.dolly(view, float(np.exp(-1.5 * up)), (0.0, 0.0), volume)
        elif self._drag == "roll":
            turned = np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0])
            outcome.view = navigation.roll(view, float((turned + np.pi) % (2 * np.pi) - np.pi))

    def _press(self, event: Event, outcome: Outcome, viewport: Viewport, now: float, mouse: bool) -> None:
        if not event.down:
            if event.name == self._button:
                self._drag = None
            return
        if not mouse or not viewport.holds(*self.cursor) or self._drag:
            return
        kinds = {"right": "dolly", "middle": "move"}
        if event.name == "left":
            kinds["left"] = "move" if "shift" in event.modifiers else "roll" if "ctrl" in event.modifiers else "turn"
        self._drag, self._button = kinds[event.name], event.name
        if event.name == "left":
            last, self._last_click = self._last_click, (now, *self.cursor)
            if (
                last
                and now - last[0] < _DOUBLE[0]
                and np.hypot(last[1] - self.cursor[0], last[2] - self.cursor[1]) < _DOUBLE[1]
            ):
                outcome.clicked, self._last_click = self.cursor, None

    def _scrolled(self, event: Event, view: View, volume: Volume, viewport: Viewport) -> View:
        if "shift" in event.modifiers:
            return navigation.advance(view, _ADVANCE * (event.y or event.x), volume)
        if "ctrl" in event.modifiers:
            return navigation.with_fov(view, view.camera.fov * 1.05**-event.y)
        return navigation.dolly(view, _WHEEL**-event.y, viewport.position(*self.cursor), volume)

    def _key(self, event: Event, outcome: Outcome, volume: Volume) -> None:
        chord = _chord(event)
        if command := _command(event):
            outcome.commands.append(command)
        elif chord in _MOVES:
            outcome.view = _MOVES[chord](outcome.view, volume)
        elif event.name in _ARROWS and not event.modifiers:
            right, up = (_STEP * part for part in _ARROWS[event.name])
            outcome.view = navigation.orbit(outcome.view, right, up, free=self.free)
        elif event.name in _ARROWS and event.modifiers == ("shift",):
            right, up = (0.1 * part for part in _ARROWS[event.name])
            outcome.view = navigation.pan(outcome.view, right, up)


def _chord(event: Event) -> str:
    return "+".join([*sorted(event.modifiers), event.name])


def _command(event: Event) -> str | None:
    """Return the command of a pressed key."""
    command = _COMMANDS.get(_chord(event))
    if command is not None and command.startswith("axis"):
        return f"axis {'-' if 'shift' in event.modifiers else '+'}{event.name}"
    return command


def pressed_commands(events: list[Event]) -> list[str]:
    """Return the commands of all keys that are pressed."""
    found = [_command(event) for event in events if event.kind == "key" and event.down]
    return [command for command in found if command is not None]


_ARROWS = {"left": (-1, 0), "right": (1, 0), "up": (0, 1), "down": (0, -1)}  # to the right, and upwards
_MOVES: dict[str, Callable[[View, Volume], View]] = {
    "page_up": lambda view, volume: navigation.dolly(view, 1 / _WHEEL, (0.0, 0.0), volume),
    "page_down": lambda view, volume: navigation.dolly(view, _WHEEL, (0.0, 0.0), volume),
    "w": lambda view, volume: navigation.advance(view, _ADVANCE, volume),
    "s": lambda view, volume: navigation.advance(view, -_ADVANCE, volume),
    "q": lambda view, _: navigation.roll(view, -_STEP),
    "e": lambda view, _: navigation.roll(view, _STEP),
    "left_bracket": lambda view, _: navigation.with_fov(view, view.camera.fov * (1 / 1.1)),
    "right_bracket": lambda view, _: navigation.with_fov(view, view.camera.fov * 1.1),
}
