"""Colour maps by the names of the library `cmap`, such as `batlow` or `cmocean:thermal`, as transfer functions.

The extinction grows with the square of the fraction of the range, since a colour map has none.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.transfer.foreign.content import DENSEST
from texvol.scene.transfer.foreign.sampling import in_extinction, sampled
from texvol.util.color import linear_from_srgb
from texvol.util.errors import InputError

_KNOTS = 17
_NAME = re.compile(r"[\w:+.-]{1,80}")


def is_color_map(name: str) -> bool:
    """True if the library knows a colour map of that name, or of a name without `_r`, which reverses it."""
    if not _NAME.fullmatch(name):
        return False
    from cmap import Catalog

    try:
        return name.removesuffix("_r") in Catalog()
    except (ValueError, KeyError, TypeError):  # a catalogue does not say no
        return False


def names() -> list[str]:
    """Return the short names of all colour maps."""
    from cmap import Catalog

    return sorted(name for name in Catalog().short_keys() if ":" not in name)


def extinction(fraction: float) -> float:
    """Return the extinction at a fraction of the range, per mean edge of the volume's box."""
    return DENSEST * fraction**2


def ramp(name: str) -> list[tuple[float, tuple[float, float, float], float]]:
    """Return points of a colour map: fraction of the range, linear colour and extinction per mean edge of the box.

    Raises
    ------
    InputError
        If the map is a list of colours without an order.
    """
    from cmap import Colormap

    found: Any = Colormap(name)
    if found.interpolation == "nearest":
        raise InputError(f"colour map {name} must be a ramp, got a list of colours, which is for labels")

    # The colours that the library's tables are made of: a call would return one of 256.
    places = np.asarray(found.color_stops.stops, np.float64)
    colors = np.asarray(found.color_stops.color_array, np.float64)

    def between(low: float, high: float) -> Callable[[float], NDArray[np.float64]]:
        return lambda value: np.array([*(np.interp(value, places, colors[:, axis]) for axis in range(3)), 0.0])

    points = []
    for sample in sampled(np.linspace(0, 1, _KNOTS).tolist(), between, in_extinction):
        red, green, blue = linear_from_srgb(sample.numbers[:3]).tolist()
        points.append((sample.value, (red, green, blue), extinction(sample.value)))
    return points
