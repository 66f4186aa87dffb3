"""Colour and opacity of a whole volume: its transfer function in one hue, and as many times as dense.

Both are of the transfer function that the volume had before: it is remembered with the new one, so that a slider may be
moved to and fro, and undo brings the old numbers back.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.adjusting import denser
from texvol.window.navigation import triple

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Tint:
    """Transfer function `base` in one colour, or in its own ones, and `opacity` times as dense."""

    base: TransferFunction
    color: Color | None = None
    opacity: float = 1.0

    def applied(self) -> TransferFunction:
        """Return the transfer function."""
        found = self.base if self.color is None else tinted(self.base, self.color)
        if self.opacity != 1:
            found = denser(found, self.opacity)
        if found is not self.base:
            _TINTS[found] = self
        return found

    @property
    def shown_color(self) -> Color:
        """Linear colour that stands for the whole."""
        return brightest(self.base) if self.color is None else self.color


_TINTS: WeakKeyDictionary[TransferFunction, Tint] = WeakKeyDictionary()


def tint_of(medium: TransferFunction) -> Tint:
    """Return how a transfer function was made by `Tint.applied`; of any other one, itself as it is."""
    return _TINTS.get(medium) or Tint(medium)


def brightest(medium: TransferFunction) -> Color:
    """Return the colour of the point that shows most, with a brightest component of 1 where the medium emits."""
    shown = medium.colors[medium.extinctions > 0] if not medium.emissive else medium.colors
    emitted = [*(each.emissions for each in medium.graded), *(np.array([each.emission]) for each in medium.contours)]
    is_amount = medium.glows or not len(shown)
    if not len(shown) and emitted:
        shown = np.concatenate(emitted)
    if not len(shown):
        return 0.0, 0.0, 0.0
    color = shown[int(shown.max(axis=1).argmax())]
    peak = float(color.max())
    return triple(np.clip(color / peak if is_amount and peak > 0 else color, 0, 1))


def tinted(medium: TransferFunction, color: Color) -> TransferFunction:
    """Return the transfer function with all its colours in one hue; what is darker stays darker."""
    hue = np.array(color)
    # Straight colours are fractions, of which the brightest that shows becomes the hue itself.
    peak = 1.0 if medium.glows else float((medium.colors.max(axis=1) * (medium.extinctions > 0)).max()) or 1.0
    graded = tuple(replace(each, emissions=_in_hue(each.emissions, hue)) for each in medium.graded)
    contours = tuple(
        replace(each, emission=triple(_in_hue(np.array([each.emission]), hue)[0])) for each in medium.contours
    )
    colors = np.minimum(_in_hue(medium.colors / peak, hue), np.inf if medium.glows else 1.0)
    named = tuple(triple(max(each) * hue) for each in medium.material_colors)
    return replace(medium, colors=colors, graded=graded, contours=contours, material_colors=named)


def _in_hue(colors: NDArray[np.float64], hue: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(colors.max(axis=1, keepdims=True) * hue)
