"""Points between which two functions agree: lines of texvol's linear light and extinction, or of sRGB and opacity.

An interval is halved until the line between its ends is near the function at three places inside.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.optics import depth_from_opacity, opacity_from_depth
from texvol.scene.transfer.foreign.curves import Curve, Node
from texvol.util.color import linear_from_srgb, srgb_from_linear

Numbers = NDArray[np.float64]
Function = Callable[[float], Numbers]  # sRGB and opacity of a value, shape (4,)
TOLERANCE = 1 / 1024  # of opacity and encoded colour: a quarter of a step of 8 bits
_DEEPEST = 14  # halvings
_INSIDE = (0.25, 0.5, 0.75)


class Sample(NamedTuple):
    """Value, and sRGB and opacity there, shape (4,)."""

    value: float
    numbers: Numbers


def sampled(knots: Iterable[float], between: Callable[[float, float], Function], line: Callable) -> list[Sample]:
    """Return values and numbers at the knots and as many further values as lines need.

    Parameters
    ----------
    knots : floats
        Values where the function may have a kink or a step.
    between : callable
        Returns the function between two neighbouring knots, at these as seen from between.
    line : callable
        Returns the numbers on the line between two, at a fraction, as they will be interpolated.
    """
    places = sorted(set(knots))
    if len(places) == 1:
        return [Sample(places[0], between(places[0], places[0])(places[0]))]
    found: list[Sample] = []
    for low, high in pairwise(places):
        function = between(low, high)
        first, last = Sample(low, function(low)), Sample(high, function(high))
        if not found or not np.array_equal(found[-1].numbers, first.numbers):
            found.append(first)
        found += [*_halved(function, first, last, line, 0), last]
    return found


def _halved(function: Function, first: Sample, last: Sample, line: Callable, depth: int) -> list[Sample]:
    """Return the samples between two."""
    middle = first.value / 2 + last.value / 2
    if depth >= _DEEPEST or not first.value < middle < last.value:
        return []
    for fraction in _INSIDE:
        value = first.value * (1 - fraction) + last.value * fraction
        off = np.abs(line(first.numbers, last.numbers, fraction) - function(value))
        if off.max() > TOLERANCE:
            break
    else:
        return []
    half = Sample(middle, function(middle))
    before, after = (first, half), (half, last)
    return [
        *_halved(function, *before, line, depth + 1),
        half,
        *_halved(function, *after, line, depth + 1),
    ]


def in_extinction(first: Numbers, last: Numbers, fraction: float) -> Numbers:
    """Return the numbers between two as texvol has them: linear in light and extinction."""
    light = linear_from_srgb(first[:3]) * (1 - fraction) + linear_from_srgb(last[:3]) * fraction
    depths = depth_from_opacity([first[3], last[3]])
    if np.isinf(depths).any():  # opaque as far as the neighbouring point
        return np.array([*srgb_from_linear(light), 1.0])
    return np.array([*srgb_from_linear(light), opacity_from_depth(depths[0] * (1 - fraction) + depths[1] * fraction)])


def in_opacity(first: Numbers, last: Numbers, fraction: float) -> Numbers:
    """Return the numbers between two as VTK has them: linear in sRGB and opacity."""
    return first * (1 - fraction) + last * fraction


def points_of(color: Curve, opacity: Curve, unit: float = 1.0) -> list[dict[str, Any]]:
    """Return the points of a transfer-function file for a colour in sRGB and an opacity over a length of `unit`."""

    def between(low: float, high: float) -> Function:
        colors, opacities = color.inside(low, high), opacity.inside(low, high)
        return lambda value: np.array([*colors(value), *opacities(value)])

    found = sampled([*color.knots, *opacity.knots], between, in_extinction)
    before, after = (np.concatenate([c.numbers, o.numbers]) for c, o in _ends(color, opacity))
    if not np.array_equal(found[0].numbers, before):
        found.insert(0, Sample(found[0].value, before))
    if not np.array_equal(found[-1].numbers, after):
        found.append(Sample(found[-1].value, after))
    return [_point(sample, unit) for sample in found]


def _ends(color: Curve, opacity: Curve) -> tuple[tuple[Node, Node], tuple[Node, Node]]:
    """Return the nodes of both curves that hold before the first value and after the last."""
    return (color.first, opacity.first), (color.last, opacity.last)


def _point(sample: Sample, unit: float) -> dict[str, Any]:
    amount = sample.numbers[3]
    point = {"value": sample.value, "color": linear_from_srgb(sample.numbers[:3]).tolist()}
    return point | ({"opacity": 1.0} if amount >= 1 else {"extinction": float(depth_from_opacity(amount)) / unit})
