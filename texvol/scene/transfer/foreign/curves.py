"""Functions of a value as VTK has them: nodes with a midpoint and a sharpness, colours in one of several spaces.

Between nodes at x1 and x2 the fraction s = (x - x1) / (x2 - x1) becomes 1/2 at the midpoint. With sharpness h from 0.01
it is drawn to the ends, s → ½ (2 s)^(1 + 10 h) below ½, and a Hermite curve with end slopes of 1 - h follows; less is a
line, and a colour of more than 0.99 a step.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from itertools import pairwise
from math import log10
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.transfer.foreign.color_spaces import in_rgb
from texvol.util.errors import InputError

Numbers = NDArray[np.float64]
Mix = Callable[[Numbers, Numbers, float], Numbers]
_LINE, _STEP = 0.01, 0.99  # sharpness
_MOST = 1 << 16  # nodes
_ROUNDING = 1e-6  # by which numbers of other programs may lie outside of [0, 1]


class Node(NamedTuple):
    """Value, the numbers there, and how the function goes on from there to the next node."""

    value: float
    numbers: Numbers
    midpoint: float = 0.5
    sharpness: float = 0.0


class Segment(NamedTuple):
    """Function between two values."""

    first: Node
    second: Node
    mix: Mix
    logarithmic: bool = False

    def at(self, value: float) -> Numbers:
        """Return the function at a value between the two, or at one of them as seen from inside."""
        low, high = self.first.value, self.second.value
        if high <= low:
            return self.first.numbers
        if self.logarithmic:
            low, high, value = log10(low), log10(high), log10(value)
        fraction = min(max((value - low) / (high - low), 0.0), 1.0)
        one, other, sharpness = self.first.numbers, self.second.numbers, self.first.sharpness
        middle = min(max(self.first.midpoint, 1e-5), 1 - 1e-5)
        fraction = 0.5 * fraction / middle if fraction < middle else 0.5 + 0.5 * (fraction - middle) / (1 - middle)
        if sharpness < _LINE:
            return self.mix(one, other, fraction)
        return _hermite(one, other, fraction, sharpness)


def _hermite(one: Numbers, other: Numbers, s: float, sharpness: float) -> Numbers:
    power = 1 + 10 * sharpness
    s = 0.5 * (2 * s) ** power if s < 0.5 else 1 - 0.5 * (2 * (1 - s)) ** power
    slope = (1 - sharpness) * (other - one)
    curve = (2 * s**3 - 3 * s**2 + 1) * one + (3 * s**2 - 2 * s**3) * other
    curve += (s**3 - 2 * s**2 + s) * slope + (s**3 - s**2) * slope
    return np.clip(curve, np.minimum(one, other), np.maximum(one, other))


class Curve:
    """Function of a value: that of its segments, constant before the first and after the last node."""

    def __init__(self, nodes: Sequence[Node], mix: Mix = in_rgb, *, logarithmic: bool = False) -> None:
        self.segments = [
            part
            for first, second in pairwise(nodes)
            if second.value > first.value
            for part in _parts(Segment(first, second, mix, logarithmic))
        ]
        self.first, self.last = nodes[0], nodes[-1]
        self.starts = [each.first.value for each in self.segments]

    @property
    def knots(self) -> list[float]:
        """Values at which segments meet."""
        return [*self.starts, self.last.value] if self.starts else [self.first.value]

    def inside(self, low: float, high: float) -> Callable[[float], Numbers]:
        """Return the function between two neighbouring knots of this or a further curve."""
        middle = low / 2 + high / 2
        if not self.segments or middle < self.first.value:
            return lambda value: self.first.numbers
        if middle > self.last.value:
            return lambda value: self.last.numbers
        return self.segments[bisect_right(self.starts, middle) - 1].at


def _parts(segment: Segment) -> list[Segment]:
    """Return the segment, or both sides of its step."""
    first, second = segment.first, segment.second
    if first.sharpness <= _STEP or first.numbers.size == 1:  # VTK's opacities have no step
        return [segment]
    low, high = first.value, second.value
    if segment.logarithmic:
        middle = 10 ** (log10(low) + first.midpoint * (log10(high) - log10(low)))
    else:
        middle = low + first.midpoint * (high - low)
    before, after = Node(low, first.numbers), Node(middle, second.numbers)
    both = (Segment(before, Node(middle, first.numbers), in_rgb), Segment(after, Node(high, second.numbers), in_rgb))
    return [each for each in both if each.second.value > each.first.value]


def nodes_of(
    numbers: Sequence[float], width: int, what: str, *, shaped: bool = False, ordered: bool = True
) -> list[Node]:
    """Return the nodes of a flat list: value and `width` numbers each, and if `shaped` midpoint and sharpness.

    Without `ordered` the list is sorted, as VTK and 3D Slicer do; nodes of the same value stay in order.

    Raises
    ------
    InputError
        If the length does not fit, a number is not finite, numbers lie outside of [0, 1], or values descend.
    """
    step = 1 + width + (2 if shaped else 0)
    if not numbers or len(numbers) % step:
        raise InputError(f"{what} must be a list of {step} numbers for each point, got {len(numbers)} numbers")
    table = np.array(numbers, np.float64).reshape(-1, step)
    if len(table) > _MOST:
        raise InputError(f"{what} must have at most {_MOST} points, got {len(table)}")
    if not ordered:
        table = table[np.argsort(table[:, 0], kind="stable")]
    numbers_of = table[:, 1 : 1 + width]
    clipped = np.clip(numbers_of, 0, 1)
    numbers_of[:] = np.where(np.abs(numbers_of - clipped) < _ROUNDING, clipped, numbers_of)
    check_table(table, width, what)
    shapes = table[:, 1 + width :] if shaped else np.tile([0.5, 0.0], (len(table), 1))
    return [
        Node(float(row[0]), row[1 : 1 + width].copy(), float(shape[0]), float(shape[1]))
        for row, shape in zip(table, shapes, strict=True)
    ]


def bounded(nodes: Sequence[Node], below: Numbers | None, above: Numbers | None) -> list[Node]:
    """Return nodes with other numbers before the first and after the last, where these are given."""
    first = [] if below is None else [Node(nodes[0].value, below)]
    return [*first, *nodes, *([] if above is None else [Node(nodes[-1].value, above)])]


def check_positive(nodes: Sequence[Node], what: str) -> None:
    """Raise InputError unless the values of nodes have logarithms."""
    if not nodes[0].value > 0:
        raise InputError(f"values of {what}, got {nodes[0].value:g}")


def check_table(table: Numbers, width: int, what: str) -> None:
    """Raise InputError unless rows of value and numbers are finite, in [0, 1] and in order."""
    if not np.isfinite(table).all():
        raise InputError(f"{what} must be finite numbers")
    numbers, values = table[:, 1:], table[:, 0]
    if numbers.min() < 0 or numbers.max() > 1:
        raise InputError(f"{what} must be from 0 to 1, got {numbers.min():g} to {numbers.max():g}")
    fallen = np.flatnonzero(np.diff(values) < 0)
    if fallen.size:
        before, after = values[fallen[0] : fallen[0] + 2]
        raise InputError(f"values of {what} must ascend, got {after:g} after {before:g}")
