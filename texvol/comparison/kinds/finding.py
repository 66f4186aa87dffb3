"""A Finding is a kind of difference that was found in a pair, and the pair without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from texvol.comparison.kinds.kind import Kind, other
from texvol.comparison.kinds.pair import Pair, Pixels

# A difference is 1 of the part that a hypothesis has in it, within what rounding and noise add; ten times the scatter
# of that is no chance.
_ONE_TO_ONE, _SIGNIFICANT = 0.5, 10.0
_TIE = 1e-3  # of what is left at all


@dataclass(frozen=True)
class Change:
    """What may have happened to each pixel of one picture by itself, with its numbers fitted already.

    Attributes
    ----------
    applied_to : "candidate" or "reference"
        Which picture has to undergo it to become the other.
    apply : function
        Premultiplied pixels (height, width, 4) → the same pixels changed.
    fitted : int
        How many numbers were fitted: the fewer, the likelier.
    is_idempotent : bool
        Whether it changes nothing the second time.
    """

    name: str
    applied_to: str
    apply: Callable[[Pixels], Pixels]
    words: str
    parameters: dict[str, Any] = field(default_factory=dict)
    fitted: int = 0
    is_idempotent: bool = False

    def explained(self, pair: Pair) -> float:
        """Share of the squared difference that goes away when the change is undone.

        A change that makes all numbers smaller makes any difference smaller, which is no explanation. So it has also
        to beat, by the same measure, two pictures that were the same before both were changed; except for one that
        changes nothing the second time, such as a rounding.
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
        # Of several that leave no more than rounding the one is best that leaves least.
        fraction -= _TIE * undone.total / pair.total
        both = self._on(undone, other(self.applied_to)).beyond_floor
        return min(fraction, 1 - undone.beyond_floor / both) if both > 0 else 0.0

    def undone(self, pair: Pair) -> Pair:
        """The pair whose other picture has the change as well."""
        return self._on(pair, self.applied_to)

    def _on(self, pair: Pair, side: str) -> Pair:
        changed, rounding = self.apply(pair.of(side)), pair.rounding_of(side)
        if rounding is None or not rounding.any():
            return pair.with_side(side, changed)
        if self.is_idempotent:
            return pair.with_side(side, changed)
        # Half a step becomes what the change makes of it.
        moved = self.apply(pair.of(side) + rounding) - changed
        return pair.with_side(side, changed, np.abs(np.where(np.isfinite(moved), moved, 0)).astype(np.float32))


@dataclass(frozen=True)
class Finding:
    """A kind, the pair that is left when it is undone, and how many numbers were fitted."""

    kind: Kind
    left: Pair
    fitted: int = 0


def goes_with(pair: Pair, left: Pair) -> bool:
    """Whether the difference goes with what is undone, one to one, and not by chance."""
    before = pair
    if left.size != pair.size:  # what a shift left out at the borders
        across, down = left.corner[0] - pair.corner[0], left.corner[1] - pair.corner[1]
        before = pair.part(slice(down, down + left.size[1]), slice(across, across + left.size[0]))
    difference = before.difference.astype(np.float64)
    undone = difference - left.difference
    products, squares = float(np.vdot(difference, undone)), float(np.vdot(undone, undone))
    if not squares > 0:
        return False
    scatter = float(np.square(difference).sum()) / (left.size[0] * left.size[1])
    return abs(products / squares - 1) < _ONE_TO_ONE and products > _SIGNIFICANT * np.sqrt(squares * scatter)
