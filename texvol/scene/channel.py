"""One channel of an image of several, such as a stain: its name, colour and window of values."""

from __future__ import annotations

from typing import NamedTuple


class Channel(NamedTuple):
    """Channel of an image, as its store describes it."""

    number: int
    name: str = ""
    color: tuple[float, float, float] | None = None  # linear RGB
    window: tuple[float, float] | None = None  # values that are drawn dark and bright
    active: bool = True
