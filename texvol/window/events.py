"""Events of mouse, keyboard and window, as data: the same for real input and for input played back by a script.

Positions are in window coordinates, from the upper left corner. Keys and mouse buttons have names.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal, get_args

from texvol.util.errors import InputError

Kind = Literal["move", "button", "scroll", "key", "text", "drop", "focus", "resize", "iconify", "close"]
KINDS: tuple[str, ...] = get_args(Kind)
BUTTONS = ("left", "right", "middle")
MOST_NOTCHES = 10.0  # of the wheel in one event
MODIFIERS = ("shift", "ctrl", "alt")
# Names of GLFW.
KEYS = frozenset(
    (*"abcdefghijklmnopqrstuvwxyz0123456789", *(f"f{number}" for number in range(1, 26)))
    + ("apostrophe", "backslash", "backspace", "caps_lock", "comma", "delete", "down", "end", "enter", "equal")
    + ("escape", "grave_accent", "home", "insert", "left", "left_alt", "left_bracket", "left_control", "left_shift")
    + ("left_super", "menu", "minus", "num_lock", "page_down", "page_up", "pause", "period", "print_screen", "right")
    + ("right_alt", "right_bracket", "right_control", "right_shift", "right_super", "scroll_lock", "semicolon")
    + ("slash", "space", "tab", "up", "world_1", "world_2")
    + tuple(f"kp_{number}" for number in range(10))
    + ("kp_add", "kp_decimal", "kp_divide", "kp_enter", "kp_equal", "kp_multiply", "kp_subtract")
)

_LETTERS = frozenset(
    ("apostrophe", "backslash", "comma", "equal", "grave_accent", "left_bracket", "minus", "period", "right_bracket")
    + ("semicolon", "slash", "space", "world_1", "world_2", "kp_add", "kp_decimal", "kp_divide", "kp_equal")
    + ("kp_multiply", "kp_subtract", "left_shift", "right_shift", *(f"kp_{number}" for number in range(10)))
)  # keys of which text comes, besides letters and digits


@dataclass(frozen=True)
class Event:
    """One input event.

    Attributes
    ----------
    kind : str
        "move": the mouse moved to (x, y). "button", "key": `name` was pressed, or released if `down` is False.
        "scroll": by (x, y). "text": `name` was typed. "drop": files with the paths `names`. "focus", "iconify": gained
        if `down` is True, else lost. "resize": to size (x, y). "close": the window is to be closed.
    modifiers : tuple of str
        Pressed modifier keys, of MODIFIERS.

    Raises
    ------
    InputError
        If a kind, button, key or modifier is unknown, or a name is no text of Unicode.
    """

    kind: Kind
    x: float = 0.0
    y: float = 0.0
    name: str = ""
    down: bool = False
    names: tuple[str, ...] = ()
    modifiers: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"event kind must be one of {', '.join(KINDS)}, got {self.kind!r}")
        if not is_unicode(self.name):
            raise InputError(f"event name must be a text of Unicode, got {self.name!r}")
        if self.kind == "button" and self.name not in BUTTONS:
            raise InputError(f"mouse button must be one of {', '.join(BUTTONS)}, got {self.name!r}")
        if self.kind == "key" and self.name not in KEYS:
            raise InputError(f"key must be a name such as a, 1, f1, page_up, left or kp_add, got {self.name!r}")
        if unknown := set(self.modifiers) - set(MODIFIERS):
            raise InputError(f"modifier must be one of {', '.join(MODIFIERS)}, got {sorted(unknown)[0]!r}")

    def as_json(self) -> dict[str, Any]:
        """Return the kind, and the attributes that differ from their defaults."""
        plain = {field.name: field.default for field in fields(self)}
        return {key: value for key, value in asdict(self).items() if value != plain[key]}

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> Event:
        """Return the event that `as_json` described; raise InputError if the content is not valid.

        A turn of the wheel is at most MOST_NOTCHES: the view changes exponentially with it.
        """
        if unknown := content.keys() - _CONVERT.keys():
            raise InputError(f"event keys must be of {', '.join(_CONVERT)}, got {min(unknown)!r} in {content!r}")
        try:
            event = cls(**{key: _CONVERT[key](value) for key, value in content.items()})
        except (OverflowError, TypeError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"event {content!r} is not valid: {error}") from None
        if event.kind != "scroll":
            return event
        return replace(event, **{axis: min(max(getattr(event, axis), -MOST_NOTCHES), MOST_NOTCHES) for axis in "xy"})


def is_unicode(text: str) -> bool:
    """True unless a text has one half of a surrogate pair alone, which JSON can hold and Dear ImGui refuses."""
    return not any("\ud800" <= letter <= "\udfff" for letter in text)


def _number(value: Any) -> float:
    number = float(value)
    if not abs(number) < 1e6:
        raise ValueError(f"a coordinate must be smaller than 1e6, got {value!r}")
    return number


def _names(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
        raise ValueError(f"names must be a list of strings, got {value!r}")
    return tuple(value)


_CONVERT: dict[str, Any] = {
    "kind": str, "x": _number, "y": _number, "name": str, "down": bool, "names": _names, "modifiers": _names,
}  # fmt: skip


class Queue:
    """Events that wait for a frame.

    A frame of Dear ImGui knows where the mouse is, which buttons and keys are down, and what was typed, but not in
    which order that came about; some of its controls hear a click only if the mouse was over them in the frame before.
    So `take` returns no more events than one frame can tell apart. Letters that are typed fast stay together.

    Attributes
    ----------
    late : float
        Seconds since the last event of those taken last came: clicks that slow frames take apart are a double click.
    """

    def __init__(self) -> None:
        self._waiting: deque[tuple[Event, float]] = deque()  # and when they came
        self.late = 0.0

    def __bool__(self) -> bool:
        """Return True if events wait."""
        return bool(self._waiting)

    def put(self, event: Event) -> int:
        """Add an event, and return the number of those that wait; a move replaces the move directly before it."""
        if event.kind == "move" and self._waiting and self._waiting[-1][0].kind == "move":
            self._waiting.pop()
        self.append(event)
        return len(self._waiting)

    def append(self, event: Event, late: float = 0.0) -> None:
        """Add an event of a script that was due `late` seconds ago.

        Every move counts, so that what is played back depends on no frame rate.
        """
        self._waiting.append((event, time.monotonic() - late))

    def take(self) -> list[Event]:
        """Return the next events in order, as many as belong in one frame."""
        taken: list[Event] = []
        self.late = 0.0
        while self._waiting and not _comes_later(self._waiting[0][0], taken):
            event, came = self._waiting.popleft()
            taken.append(event)
            self.late = time.monotonic() - came
        return taken


_AFTER = {  # kinds of events after which an event of a kind needs another frame
    "move": {"button", "scroll"},
    "button": {"move", "button", "scroll", "key", "text"},
    "scroll": {"move", "button"},
    "key": {"button", "scroll", "text"},
    "text": {"button", "key"},
}


def _comes_later(event: Event, before: list[Event]) -> bool:
    """True if an event belongs in a later frame than the events before it."""
    if event.kind == "key" and any(each.down and _is_chord(each) for each in before):
        return True  # a release of ctrl in the frame of ctrl+a would make it a mere a
    if _is_typed(event):
        return any(each.kind == "button" for each in before)
    if event.kind == "scroll" and any(each.kind == "scroll" and each.modifiers != event.modifiers for each in before):
        return True
    again = {(each.kind, each.name) for each in before if each.kind == "key"}
    if (event.kind, event.name) in again:
        return True
    return any(
        each.kind in _AFTER.get(event.kind, ()) and not (each.kind == "key" and _is_typed(each)) for each in before
    )


def _is_typed(event: Event) -> bool:
    """True for a key whose press is a letter to be typed."""
    is_letter = len(event.name) == 1 or event.name in _LETTERS
    return event.kind == "key" and is_letter and not _is_chord(event)


def _is_chord(event: Event) -> bool:
    """True for a key that is pressed or released while ctrl or alt is down."""
    return event.kind == "key" and bool({"ctrl", "alt"} & set(event.modifiers))
