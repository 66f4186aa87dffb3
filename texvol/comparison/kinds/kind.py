"""A kind of difference between two pictures: its name, the fraction that it explains, and its parameters."""

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
    """Kind of difference between a candidate and a reference.

    Attributes
    ----------
    name : str
        A member of `NAMES`.
    explained : float
        Fraction of the squared difference that disappears when the kind is undone, 0 to 1. For noise and edges, which
        cannot be undone, the fraction that is of that kind; 1 for pixels that are not finite, 0 for "unexplained".
    words : str
        A sentence for people.
    parameters : mapping
        Parameters of the kind, of JSON's types.
    """

    name: str
    explained: float
    words: str
    parameters: Mapping[str, Any] = field(default_factory=dict)


def other(side: str) -> str:
    """Return "reference" for "candidate", and the reverse."""
    return "reference" if side == "candidate" else "candidate"


def number(value: float, digits: int = 3) -> str:
    """Format a number with a few digits."""
    return f"{value:.{digits}g}"
