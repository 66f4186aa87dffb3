"""Remarks that a command makes when it has ended, since only then their numbers are known."""

from __future__ import annotations

from typing import Protocol


class Noted(Protocol):
    """Thing with sentences about it."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences of the moment."""


_late: list[Noted] | None = None  # None while no command runs: then nobody would ask for them


def begin() -> None:
    """Begin to remember what is to be told when the command has ended."""
    global _late
    _late = []


def make_at_end(noted: Noted) -> None:
    """Remember a thing, whose notes are told when the command has ended; do nothing while no command runs."""
    if _late is not None and all(each is not noted for each in _late):
        _late.append(noted)


def taken() -> list[str]:
    """Return the notes of all such things, sorted, each once, and forget the things."""
    global _late
    found = sorted({sentence for each in _late or () for sentence in each.notes})
    _late = None
    return found
