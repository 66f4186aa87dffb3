"""Remarks that a command makes when it has ended, since only then their numbers are known."""

from __future__ import annotations

from typing import Protocol
from weakref import WeakSet


class Noted(Protocol):
    """Thing with sentences about it."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences of the moment."""


_LATE: WeakSet[Noted] = WeakSet()


def make_at_end(noted: Noted) -> None:
    """Remember a thing, whose notes are told when the command has ended."""
    _LATE.add(noted)


def taken() -> list[str]:
    """Return the notes of all such things, sorted, each once, and forget the things."""
    found = sorted({sentence for each in _LATE for sentence in each.notes})
    _LATE.clear()
    return found
