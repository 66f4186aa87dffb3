"""Content of a transfer-function file made of another program's, and the length that its opacities belong to."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from texvol.scene.transfer.foreign.curves import Curve, Node
from texvol.scene.transfer.foreign.sampling import points_of
from texvol.util.errors import InputError

OPTION = "--unit-distance L sets another"


@dataclass(frozen=True)
class Length:
    """Length that opacities belong to: `amount` of texvol's units of length, and who says so.

    An empty `reason` is that the file does.
    """

    unit: str = "world"
    amount: float = 1.0
    reason: str = ""


@dataclass(frozen=True)
class Content:
    """Colour and opacity of another program's file, the length of its opacities, and further keys of texvol's form."""

    color: Curve
    opacity: Curve | None
    length: Length
    keys: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def with_length(self, told: float | None) -> tuple[dict[str, Any], list[str]]:
        """Return the content of texvol's form, with opacities of a length of `told` world units if given, and notes."""
        notes = list(self.notes)
        if self.opacity is None:
            fields = self._colors_alone(told)
            is_relative = "values" in fields and "values" not in self.keys
            return fields, [*notes, _COLORS_ALONE, *([_REPLACED] if is_relative else [])]
        length = self.length
        if told is not None:
            if not told > 0:
                raise InputError(f"unit distance must be above 0, got {told:g}")
            length = Length(amount=told)
        elif length.reason:
            notes.append(f"its opacities are {length.reason}; {OPTION}")
        if not 0 < length.amount < float("inf"):
            raise InputError(f"its unit distance must be a finite number above 0, got {length.amount:g}")
        points = points_of(self.color, self.opacity, length.amount)
        return {**self.keys, "points": points, "length": length.unit}, notes

    def _colors_alone(self, told: float | None) -> dict[str, Any]:
        """Return colours with an extinction that grows with the square of the fraction, as that of a colour map."""
        if told is not None:
            raise InputError("it has no opacities, and therefore no unit distance")
        low, high = self.color.first.value, self.color.last.value
        clear = Curve([Node(float(value), np.zeros(1)) for value in np.linspace(low, high, _PLACES)])
        points = points_of(self.color, clear)
        for point in points:
            fraction = (point["value"] - low) / (high - low) if high > low else 1.0
            point["extinction"] = DENSEST * fraction**2
        keys = {**self.keys, "points": points, "length": "box"}
        if (low, high) in _OF_NO_VOLUME and "values" not in self.keys:
            for point in points:
                point["value"] = (point["value"] - low) / (high - low)
            keys["values"] = "range"
        return keys


DENSEST = 30.0  # of a colour map, per mean edge of the box
_PLACES = 17  # at which its extinction is set, linear between them
_OF_NO_VOLUME = ((0.0, 1.0), (-1.0, 1.0))  # ends of ParaView's own colour maps, which it places when they are chosen
_REPLACED = "its values go from the smallest to the largest sample, as in ParaView; --range LOW,HIGH moves them"
_COLORS_ALONE = "it has no opacities: the extinction grows with the square of the fraction, as that of colour maps"
