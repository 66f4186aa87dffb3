"""Opacity and colours of a transfer function, as two layers that are edited apart.

A point of the opacity layer has a value and an extinction, a stop of the colour layer a value and a colour. The
transfer function has a point wherever a layer has one; the other layer is interpolated there. As long as every point
has both, as in most presets and files, a point that is moved takes its colour along. A colour map ends that: colours
stay where they are, whatever is done to the opacity.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from texvol.scene.transfer import TransferFunction
from texvol.window.color_maps import Stop, color_at
from texvol.window.editing import Color, Curve, Point
from texvol.window.navigation import triple

_ROUNDING = 1e-9  # of the largest number: interpolation loses less


@dataclass(frozen=True)
class Layers:
    """Points of the opacity, and colours.

    Attributes
    ----------
    curve : Curve
        Points of the opacity, with the colours there.
    palette : tuple of (value, colour)
        Stops of the colours, ascending; empty if each point of the curve has a colour of its own.
    """

    curve: Curve
    palette: tuple[Stop, ...] = ()

    @classmethod
    def of(cls, medium: TransferFunction) -> Layers:
        """Return the layers of a transfer function: points that no opacity needs are stops of colours alone."""
        curve = Curve.of(medium)
        if medium.glows:
            return cls(curve)
        kept = _needed([(point.value, (point.extinction,)) for point in curve.points])
        if len(kept) == len(curve.points):
            return cls(curve)
        kept = _without_flat_ends(kept, curve.points)
        stops = [(point.value, point.color) for point in curve.points]
        palette = tuple(stops[number] for number in _needed(stops))
        return cls(Curve(tuple(curve.points[number] for number in kept)), palette)

    def applied(self, medium: TransferFunction) -> TransferFunction:
        """Return the transfer function with these layers."""
        if not self.palette:
            return self.curve.applied(medium)
        points = self.merged.points
        return replace(
            medium,
            values=np.array([point.value for point in points]),
            colors=np.clip([point.color for point in points], 0.0, 1.0),
            extinctions=np.array([point.extinction for point in points]),
            premultiplied=False,
            materials=(),  # their colours are no longer those of the medium
            material_colors=(),
        )

    @property
    def merged(self) -> Curve:
        """Points of both layers."""
        shape = {value: list(points) for value, points in groupby(self.curve.points, key=lambda point: point.value)}
        values = sorted({*shape, *(value for value, _ in self.palette)})
        found: list[Point] = []
        for value in values:
            at = shape.get(value) or [self._on_curve(value)]
            left, right = (triple(color_at(self.palette, value, left=is_left)) for is_left in (True, False))
            if len(at) == 1 and left != right:
                at = [at[0], at[0]]
            found += [replace(point, color=right if number else left) for number, point in enumerate(at)]
        return Curve(tuple(found))

    def with_curve(self, curve: Curve) -> Layers:
        """Return the layers with another curve, whose points take the colours of the palette if there is one."""
        if not self.palette:
            return Layers(curve)
        points = (replace(each, color=triple(color_at(self.palette, each.value))) for each in curve.points)
        return Layers(Curve(tuple(points)), self.palette)

    def with_palette(self, palette: Sequence[Stop]) -> Layers:
        """Return the layers with other colours, at values."""
        return Layers(self.curve, tuple(palette)).with_curve(self.curve)

    def colored(self, index: int, color: Color) -> Layers:
        """Return the layers with another colour at point `index` of the curve."""
        if not self.palette:
            return Layers(self.curve.colored(index, color))
        value, color = self.curve.points[index].value, triple(np.clip(color, 0.0, 1.0))
        others = [stop for stop in self.palette if stop[0] != value]
        return self.with_palette(sorted([*others, (value, color)], key=lambda stop: stop[0]))

    def mapped(self, place: Callable[[np.ndarray], np.ndarray], factor: float) -> Layers:
        """Return the layers with their values placed elsewhere, and extinctions multiplied."""
        values = place(np.array([point.value for point in self.curve.points]))
        points = [replace(each, value=float(value)) for each, value in zip(self.curve.points, values, strict=True)]
        curve = Curve(tuple(points)).denser(factor)
        if not self.palette:
            return Layers(curve)
        places = place(np.array([value for value, _ in self.palette]))
        palette = tuple((float(value), color) for value, (_, color) in zip(places, self.palette, strict=True))
        return Layers(curve, palette)

    def _on_curve(self, value: float) -> Point:
        with_it, index = self.curve.added(value)
        return with_it.points[index]


def _needed(rows: Sequence[tuple[float, Sequence[float]]]) -> list[int]:
    """Return the rows (value, numbers) that are not on a line between the others; the ends always are kept."""
    numbers = np.array([row for _, row in rows], np.float64)
    finite = np.where(np.isinf(numbers), 0.0, numbers)
    slack = _ROUNDING * max(float(np.abs(finite).max()), 1e-300)
    # Two equal rows at one value are one.
    kept = [0]
    for number in range(1, len(rows)):
        before = kept[-1]
        if rows[number][0] != rows[before][0] or not np.array_equal(numbers[number], numbers[before]):
            kept.append(number)
    found = kept[:1]
    for before, number, after in zip(kept, kept[1:], kept[2:], strict=False):
        if not _on_line(rows[before], rows[number], rows[after], slack):
            found.append(number)
    return found + kept[-1:] if len(kept) > 1 else found


def _on_line(
    before: tuple[float, Sequence[float]],
    row: tuple[float, Sequence[float]],
    after: tuple[float, Sequence[float]],
    slack: float,
) -> bool:
    """True if a row lies on the line between its neighbours; beside an opaque point all is opaque."""
    start, end = before[0], after[0]
    if not start < row[0] < end:
        return False
    fraction = (row[0] - start) / (end - start)
    for one, number, other in zip(before[1], row[1], after[1], strict=True):
        if np.isinf(number) or np.isinf(one) or np.isinf(other):
            if not (np.isinf(number) and (np.isinf(one) or np.isinf(other))):
                return False
        elif abs((1 - fraction) * one + fraction * other - number) > slack:
            return False
    return True


def _without_flat_ends(kept: list[int], points: Sequence[Point]) -> list[int]:
    """Return the points without those ends at which the opacity is that of the next point, as beyond all ends."""
    while len(kept) > 2 and points[kept[0]].extinction == points[kept[1]].extinction:
        kept = kept[1:]
    while len(kept) > 2 and points[kept[-1]].extinction == points[kept[-2]].extinction:
        kept = kept[:-1]
    return kept
