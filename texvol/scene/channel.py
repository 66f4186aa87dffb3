"""One channel of an image of several, such as a stain: its name, colour and window of values."""

from __future__ import annotations

from typing import Any, NamedTuple


class Channel(NamedTuple):
    """Channel of an image, as its store describes it."""

    number: int
    name: str = ""
    color: tuple[float, float, float] | None = None  # linear RGB
    window: tuple[float, float] | None = None  # values that are drawn dark and bright
    active: bool = True


def called(channel: Channel | None, option: Any = None) -> str:
    """Return the displayed name of a channel, from its description or the reading option; "" if there is neither."""
    number = option if channel is None or option is not None else channel.number
    if channel is not None and channel.name:
        return channel.name
    return "" if number is None else f"channel {number}"
