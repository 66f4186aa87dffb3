"""What mouse, keyboard and window say, as data: the same whether a hand made it, or a script plays it back.

Positions are in window coordinates, from the upper left corner; keys and buttons have names.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal, get_args

from texvol.util.errors import InputError

Kind = Literal["move", "button", "scroll", "key", "text", "drop", "focus", "resize", "iconify", "close"]
KINDS: tuple[str, ...] = get_args(Kind)
BUTTONS = ("left", "right", "middle")
MODIFIERS = ("shift", "ctrl", "alt")
# As GLFW calls them.
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


@dataclass(frozen=True)
class Event:
    """One of them.

    Attributes
    ----------
    kind : str
        "move": to (x, y). "button", "key": `name`, `down`. "scroll": by (x, y). "text": `name` is what was typed.
        "drop": `names` are the paths. "focus", "iconify": `down` says whether. "resize": to (x, y). "close".
    modifiers : tuple of str
        Those of MODIFIERS that are held.
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
            raise InputError(f"an event is one of {', '.join(KINDS)}, and not {self.kind!r}")
        if self.kind == "button" and self.name not in BUTTONS:
            raise InputError(f"a button is one of {', '.join(BUTTONS)}, and not {self.name!r}")
        if self.kind == "key" and self.name not in KEYS:
            raise InputError(f"there is no key {self.name!r}; keys are called as a, 1, f1, page_up, left, kp_add")
        if unknown := set(self.modifiers) - set(MODIFIERS):
            raise InputError(f"modifiers are {', '.join(MODIFIERS)}, and not {sorted(unknown)[0]!r}")

    def as_json(self) -> dict[str, Any]:
        """What differs from the defaults, and the kind."""
        plain = {field.name: field.default for field in fields(self)}
        return {key: value for key, value in asdict(self).items() if value != plain[key]}

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> Event:
        """The event that `as_json` wrote; InputError where it is none."""
        try:
            checked = {key: _CONVERT[key](value) for key, value in content.items()}
            return cls(**checked)
        except InputError:
            raise
        except (KeyError, OverflowError, TypeError, ValueError) as error:
            raise InputError(f"no event is {content!r}: {error}") from None


def _number(value: Any) -> float:
    number = float(value)
    if not abs(number) < 1e6:
        raise ValueError(f"{value!r} is no place in a window")
    return number


def _names(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
        raise ValueError(f"{value!r} is no list of names")
    return tuple(value)


_CONVERT: dict[str, Any] = {
    "kind": str, "x": _number, "y": _number, "name": str, "down": bool, "names": _names, "modifiers": _names,
}  # fmt: skip


class Queue:
    """Events that wait for the next frame."""

    def __init__(self) -> None:
        self._waiting: deque[Event] = deque()

    def put(self, event: Event) -> None:
        """Another one; of several moves, or scrolls, in a row it is the sum that counts."""
        last = self._waiting[-1] if self._waiting else None
        if event.kind == "move" and last and last.kind == "move":
            self._waiting[-1] = event
        else:
            self._waiting.append(event)

    def extend(self, events: Iterable[Event]) -> None:
        """Several."""
        for event in events:
            self.put(event)

    def take(self) -> list[Event]:
        """All that wait, in their order."""
        taken = list(self._waiting)
        self._waiting.clear()
        return taken

    def __len__(self) -> int:
        return len(self._waiting)
