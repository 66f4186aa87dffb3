"""A kind of difference between two pictures: its name, how much it explains, and its numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

NAMES = (
    *("not finite", "rounding", "banding", "isolated pixels", "shifted", "flipped", "channels swapped"),
    *("gamma", "straight colour", "scaled opacity", "background", "brightness", "tone curve", "clipped"),
    *("swapped order", "blurred", "edges only", "noise", "unexplained"),
)
CHANNELS = ("red", "green", "blue", "opacity")


@dataclass(frozen=True)
class Kind:
    """What kind of difference there is between a candidate and a reference.

    Attributes
    ----------
    name : str
        One of `NAMES`.
    explained : float
        Share of the squared difference that goes away when it is undone, 0 … 1. For what can't be undone, noise and
        edges, the share that is of that kind; for what is not finite 1, and for what is unexplained 0.
    words : str
        A sentence for people.
    parameters : mapping
        Its numbers, as JSON has them.
    """

    name: str
    explained: float
    words: str
    parameters: Mapping[str, Any] = field(default_factory=dict)


def other(side: str) -> str:
    """The other one of "candidate" and "reference"."""
    return "reference" if side == "candidate" else "candidate"


def number(value: float, digits: int = 3) -> str:
    """A number with a few digits."""
    return f"{value:.{digits}g}"
