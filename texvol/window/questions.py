"""Questions that the window asks before it would lose something; one is shown at a time, until it is answered.

While a question is shown, keys, clicks and letters go to it and not to the picture. A script answers by keys, by the
mouse, or by the command `answer` with the words of a button.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from texvol.window.events import Event

CANCEL = "cancel"
_STEPS = {"down": 1, "right": 1, "tab": 1, "up": -1, "left": -1}


def _nothing() -> None:
    """Leave everything as it is."""


@dataclass
class Question:
    """Question with its possible answers.

    Attributes
    ----------
    text : str
        Question.
    answers : mapping
        What is done, by the words of each answer. The first answer is the default, so it must not lose anything.
    notes : tuple of str
        Lines below the question.
    cancel : callable
        What is done if the question is not answered.
    of_scene : bool
        True if the question is about the open scene: another scene takes it away.
    chosen : int
        Position of the answer that Enter gives; arrow keys and Tab change it.
    """

    text: str
    answers: Mapping[str, Callable[[], Any]]
    notes: tuple[str, ...] = ()
    cancel: Callable[[], Any] = _nothing
    of_scene: bool = False
    chosen: int = 0

    @property
    def words(self) -> tuple[str, ...]:
        """Words of all answers; the last is `CANCEL`."""
        return (*self.answers, CANCEL)

    def answer(self, words: str) -> None:
        """Do what an answer says."""
        (self.cancel if words == CANCEL else self.answers[words])()

    def hear(self, event: Event) -> str | None:
        """Return the words of the answer that a key gives; None for other events."""
        if event.kind != "key" or not event.down:
            return None
        if event.name in _STEPS:
            step = -1 if "shift" in event.modifiers else _STEPS[event.name]
            self.chosen = (self.chosen + step) % len(self.words)
        if event.name in ("enter", "kp_enter"):
            return self.words[self.chosen]
        return CANCEL if event.name == "escape" else None
