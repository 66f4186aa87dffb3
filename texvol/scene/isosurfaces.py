"""Several isosurfaces of one volume in one picture, translucent ones too; each ray meets them in order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from texvol.util.color import linear_color
from texvol.util.errors import InputError

MOST_ISOSURFACES = 8  # their values are held in registers


@dataclass(frozen=True)
class Isosurface:
    """Surface on which a volume has one value.

    Parameters
    ----------
    value : float
        Data units.
    color : (r, g, b), optional
        Linear, straight. By default that of a single isosurface: of the transfer function at that value.
    opacity : float
        From above 0 to 1, seen from any direction.

    Raises
    ------
    InputError
        If a number is out of range.
    """

    value: float
    color: tuple[float, float, float] | None = None
    opacity: float = 1.0

    def __post_init__(self) -> None:
        if not np.isfinite(self.value):
            raise InputError(f"isosurface: value must be finite, got {self.value!r}")
        object.__setattr__(self, "value", float(self.value))
        if self.color is not None:
            object.__setattr__(self, "color", linear_color(self.color, "isosurface: color"))
        if isinstance(self.opacity, bool) or not 0 < self.opacity <= 1:
            raise InputError(f"isosurface: opacity must be from above 0 to 1, got {self.opacity!r}")
        object.__setattr__(self, "opacity", float(self.opacity))


def checked_isosurfaces(isosurfaces: tuple[Isosurface, ...]) -> tuple[Isosurface, ...]:
    """Return the argument as a tuple; raise InputError if there are too many, or two have one value."""
    found = tuple(isosurfaces)
    if any(not isinstance(each, Isosurface) for each in found):
        raise InputError("isosurfaces must be a sequence of Isosurface")
    if len(found) > MOST_ISOSURFACES:
        raise InputError(f"isosurfaces must be at most {MOST_ISOSURFACES}, got {len(found)}")
    values = [each.value for each in found]
    twice = [value for value in values if values.count(value) > 1]
    if twice:
        raise InputError(f"isosurfaces must have different values, got {twice[0]:g} twice")
    return found
