"""Kinds of difference, and what they leave: a Kind for readers, a Change that may explain a pair, a Finding."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from texvol.comparison.kinds.pair import Pair, Pixels, other

NAMES = (
    *("not finite", "rounding", "banding", "isolated pixels", "shifted", "flipped", "channels swapped"),
    *("gamma", "straight colour", "scaled opacity", "background", "brightness", "tone curve", "clipped"),
    *("swapped order", "blurred", "edges only", "noise", "unexplained"),
)
CHANNELS = ("red", "green", "blue", "opacity")
# Regression of the difference on the undone part: the slope is 1 but for rounding and noise, and a slope of ten times
# its standard deviation is significant.
_ONE_TO_ONE, _SIGNIFICANT = 0.5, 10.0
_TIE = 1e-3  # weight of the rest, rounding included


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


def number(value: float, digits: int = 3) -> str:
    """Format a number with a few digits."""
    return f"{value:.{digits}g}"


@dataclass(frozen=True)
class Change:
    """Hypothesis about a change of each pixel by itself, with fitted parameters.

    Attributes
    ----------
    applied_to : "candidate" or "reference"
        The picture that becomes the other picture by the change.
    apply : function
        Premultiplied pixels (height, width, 4) → the changed pixels.
    fitted : int
        Number of fitted parameters: fewer are likelier.
    is_idempotent : bool
        True if applying the change twice is the same as applying it once, as for a rounding.
    """

    name: str
    applied_to: str
    apply: Callable[[Pixels], Pixels]
    words: str
    parameters: dict[str, Any] = field(default_factory=dict)
    fitted: int = 0
    is_idempotent: bool = False

    def explained(self, pair: Pair) -> float:
        """Return the fraction of the squared difference that disappears when the change is undone.

        A change that makes all numbers smaller makes any difference smaller, which explains nothing. So the fraction is
        at most the gain over two pictures that were equal before both were changed. Idempotent changes are exempt.
        """
        undone = self.undone(pair)
        if self.is_idempotent:
            return pair.all_explained_by(undone)
        fraction = pair.explained_by(undone)
        if fraction <= 0:
            return fraction
        if pair.roundings is None:
            both = self._on(undone, other(self.applied_to)).total
            return min(fraction, 1 - undone.total / both) if both > 0 else 0.0
        # Among changes that leave no more than rounding the one that leaves least is best.
        fraction -= _TIE * undone.total / pair.total
        both = self._on(undone, other(self.applied_to)).beyond_floor
        return min(fraction, 1 - undone.beyond_floor / both) if both > 0 else 0.0

    def undone(self, pair: Pair) -> Pair:
        """Return the pair with the change applied to the other picture, too."""
        return self._on(pair, self.applied_to)

    def _on(self, pair: Pair, side: str) -> Pair:
        changed, rounding = self.apply(pair.of(side)), pair.rounding_of(side)
        if self.is_idempotent or rounding is None or not rounding.any():
            return pair.with_side(side, changed)
        # Half a step of the format, changed like the pixels.
        moved = self.apply(pair.of(side) + rounding) - changed
        return pair.with_side(side, changed, np.abs(np.where(np.isfinite(moved), moved, 0)).astype(np.float32))


@dataclass(frozen=True)
class Finding:
    """A kind that was found in a pair, and the pair that is left when the kind is undone."""

    kind: Kind
    left: Pair


def goes_with(pair: Pair, left: Pair) -> bool:
    """True if the difference follows the undone part one to one, beyond chance."""
    before = pair
    if left.size != pair.size:  # a shift leaves out borders
        across, down = left.corner[0] - pair.corner[0], left.corner[1] - pair.corner[1]
        before = pair.part(slice(down, down + left.size[1]), slice(across, across + left.size[0]))
    difference = before.difference.astype(np.float64)
    undone = difference - left.difference
    products, squares = float(np.vdot(difference, undone)), float(np.vdot(undone, undone))
    if not squares > 0:
        return False
    scatter = float(np.square(difference).sum()) / (left.size[0] * left.size[1])
    return abs(products / squares - 1) < _ONE_TO_ONE and products > _SIGNIFICANT * np.sqrt(squares * scatter)
