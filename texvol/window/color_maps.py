"""Colour maps that a transfer function takes its colours from: by name, reversed, or in steps of one colour each.

A map is a list of stops (fraction of the range, linear colour), linear in between. Two stops at one fraction make a
step. A map of the library of colour maps has as few stops as keep its sRGB colours within 1/64, so that a transfer
function with these colours stays one that can be edited.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from texvol.util.color import linear_from_srgb, srgb_from_linear

Color = tuple[float, float, float]
Stop = tuple[float, Color]  # fraction or value, and linear colour

# Names of maps and what they are for, in groups.
GROUPS: dict[str, dict[str, str]] = {
    "even steps of lightness": {
        "viridis": "from blue to yellow; equal steps of value look equal",
        "inferno": "from black by red to light yellow; equal steps look equal",
        "magma": "from black by purple to white; equal steps look equal",
        "plasma": "from blue by red to yellow; equal steps look equal",
        "cividis": "from blue to yellow; looks the same to people who confuse red and green",
        "batlow": "from dark blue by green to pink (Crameri)",
        "mako": "from black by blue to light green",
        "grey": "from black to white",
    },
    "two sides of a middle": {
        "vik": "blue below, red above, light in the middle (Crameri)",
        "coolwarm": "blue below, red above, grey in the middle",
        "berlin": "blue below, red above, black in the middle (Crameri)",
    },
    "others": {
        "twilight": "begins and ends with one colour, for angles and phases",
        "hot": "from black by red and yellow to white, as glowing iron",
        "bone": "from black to white with a touch of blue, as X-ray films",
        "turbo": "all hues; tells values apart, but its steps do not look equal",
    },
}
NAMES = tuple(name for group in GROUPS.values() for name in group)
_OF_LIBRARY = {"grey": "matlab:gray", "coolwarm": "matplotlib:coolwarm"}
_SAMPLES = 129
_WITHIN = 1 / 64  # of sRGB
MOST_LEVELS = 16


@dataclass(frozen=True)
class MapChoice:
    """Chosen colour map.

    Attributes
    ----------
    name : str
        Name of the map, or of the look whose colours are taken.
    stops : tuple of (fraction, colour)
        Colours as the map or the look comes.
    reversed : bool
        True if the colour of the high end is at the low end.
    levels : int
        Number of steps of one colour each; 0 for colours that change continuously.
    """

    name: str
    stops: tuple[Stop, ...]
    reversed: bool = False
    levels: int = 0

    @property
    def shown(self) -> tuple[Stop, ...]:
        """Stops as they are shown."""
        stops = tuple((1 - at, color) for at, color in reversed(self.stops)) if self.reversed else self.stops
        return stepped(stops, self.levels) if self.levels else stops


@cache
def map_stops(name: str) -> tuple[Stop, ...]:
    """Return the stops of a map of `GROUPS`, from fraction 0 to 1."""
    from cmap import Colormap

    fractions = np.linspace(0, 1, _SAMPLES)
    shown = np.clip(np.asarray(Colormap(_OF_LIBRARY.get(name, name))(fractions), np.float64)[:, :3], 0, 1)
    linear = linear_from_srgb(shown)
    kept = _needed(fractions, linear, shown)
    return tuple((float(fractions[i]), _triple(linear[i])) for i in kept)


def stepped(stops: Sequence[Stop], levels: int) -> tuple[Stop, ...]:
    """Return a map of `levels` steps, whose first and last colours are those of the map's ends."""
    if levels == 1:
        return ((0.0, _triple(color_at(stops, 0.5))), (1.0, _triple(color_at(stops, 0.5))))
    colors = [_triple(color_at(stops, number / (levels - 1))) for number in range(levels)]
    edges = [number / levels for number in range(levels + 1)]
    return tuple(
        stop
        for (start, end), color in zip(pairwise(edges), colors, strict=True)
        for stop in ((start, color), (end, color))
    )


def color_at(stops: Sequence[Stop], at: float, *, left: bool = False) -> NDArray[np.float64]:
    """Return the linear colour at a fraction or value; at a step that of the right side, or of the left one."""
    places = [place for place, _ in stops]
    after = int(np.searchsorted(places, at, side="left" if left else "right"))
    if after == 0 or after == len(stops):
        return np.array(stops[min(after, len(stops) - 1)][1])
    (start, one), (end, other) = stops[after - 1], stops[after]
    fraction = (at - start) / (end - start)
    return (1 - fraction) * np.array(one) + fraction * np.array(other)


def placed(stops: Sequence[Stop], ends: tuple[float, float]) -> tuple[Stop, ...]:
    """Return stops at fractions as stops at values between the ends."""
    low, high = ends
    return tuple((low * (1 - at) + high * at, color) for at, color in stops)


def fractions_of(stops: Sequence[Stop]) -> tuple[Stop, ...]:
    """Return stops at values as stops at fractions of their range."""
    low, high = stops[0][0], stops[-1][0]
    if not high > low:
        return ((0.0, stops[0][1]), (1.0, stops[-1][1]))
    return tuple((min(max((at - low) / (high - low), 0.0), 1.0), color) for at, color in stops)


def _needed(fractions: NDArray, linear: NDArray, shown: NDArray) -> list[int]:
    """Return the samples between which all others lie within the error (Douglas, Peucker 1973)."""
    kept, waiting = {0, len(fractions) - 1}, [(0, len(fractions) - 1)]
    while waiting:
        first, last = waiting.pop()
        between = (fractions[first : last + 1] - fractions[first]) / (fractions[last] - fractions[first])
        lines = (1 - between[:, np.newaxis]) * linear[first] + between[:, np.newaxis] * linear[last]
        errors = np.abs(srgb_from_linear(lines) - shown[first : last + 1]).max(axis=1)
        if errors.max() > _WITHIN:
            middle = first + int(errors.argmax())
            kept.add(middle)
            waiting += [(first, middle), (middle, last)]
    return sorted(kept)


def _triple(color: NDArray) -> Color:
    return float(color[0]), float(color[1]), float(color[2])
