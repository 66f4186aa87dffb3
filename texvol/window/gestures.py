"""Gestures in the plot of a transfer function: what the mouse is at, and what a drag makes of the transfer function.

A drag of the curve moves its range, or multiplies its opacity, but not both: the direction of its first motion decides.
Ends are rounded to the decimals that a pixel can tell apart, and the result is that of `--range` with these numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from texvol.scene.transfer import TransferFunction, adjusting
from texvol.window import lineage
from texvol.window.editing import extinction_of, opacity_of
from texvol.window.ranges import Ends

MOST_OPACITY = 0.9999  # by dragging: a switch makes a point opaque
ENOUGH = 40  # points: more points would overlap
_OPAQUE_FROM = 0.98  # an opaque point stays opaque until it is dragged below
_LEAST_WIDTH = 1e-3  # of the shown range
_ONE_PLACE = 0.5  # pixels
_PULLED = (0.02, 0.98)  # opacities at which a drag can pull the curve
_NOTCH = 1.1  # width by one notch of the wheel
_EXTENT = 1 / 3  # of the plot: a drag this long multiplies by e

Kind = Literal["point", "low", "high", "curve", "empty"]


@dataclass(frozen=True)
class Frame:
    """Rectangle of the plot in the window, and the values and opacities that it shows."""

    shown: Ends
    left: float
    top: float
    width: float
    height: float
    headroom: float = 0.06  # of opacity, above 1: for a line of text

    def x(self, value: float) -> float:
        """Return the x coordinate of a value."""
        return self.left + (value - self.shown[0]) / (self.shown[1] - self.shown[0]) * self.width

    def y(self, opacity: float) -> float:
        """Return the y coordinate of an opacity."""
        return self.top + self.height * (1 - opacity / (1 + self.headroom))

    def value(self, x: float) -> float:
        """Return the value at an x coordinate."""
        return self.shown[0] + (x - self.left) / self.width * (self.shown[1] - self.shown[0])

    def opacity(self, y: float) -> float:
        """Return the opacity at a y coordinate, from 0 to 1."""
        return float(np.clip((1 + self.headroom) * (1 - (y - self.top) / self.height), 0, 1))

    def holds(self, x: float, y: float) -> bool:
        """True if a point of the window is in the rectangle."""
        return self.left <= x < self.left + self.width and self.top <= y < self.top + self.height

    def rounded(self, value: float) -> float:
        """Return a value with the decimals that a pixel can tell apart."""
        pixel = (self.shown[1] - self.shown[0]) / max(self.width, 1.0)
        if not (np.isfinite(value) and pixel > 0):
            return value
        return float(round(value, -int(np.floor(np.log10(pixel)))))


@dataclass(frozen=True)
class Hit:
    """Part of the plot under the mouse: a point by its `index`, an end of the curve, the area below it, or none."""

    kind: Kind
    index: int = -1


def hit(frame: Frame, medium: TransferFunction, length: float, at: tuple[float, float], reach: float) -> Hit:
    """Return the part of the plot at a point of the window."""
    x, y = at
    points = lineage.layers_of(medium).curve.points
    if len(points) <= ENOUGH:
        away = [np.hypot(frame.x(p.value) - x, frame.y(float(opacity_of(p.extinction, length))) - y) for p in points]
        # Of points in one place the last one, which is drawn on top.
        nearest = int(np.flatnonzero(np.array(away) <= min(away) + _ONE_PLACE)[-1])
        if away[nearest] <= reach:
            return Hit("point", nearest)
    low, high = adjusting.ends(medium)
    if high > low:
        for kind, end in (("low", low), ("high", high)):
            if abs(frame.x(end) - x) <= reach / 2:
                return Hit("low" if kind == "low" else "high")
    top, bottom = frame.y(float(opacity_of(medium.at(frame.value(x))[3], length))), frame.y(0.0)
    return Hit("curve") if y >= top - reach / 2 and bottom - top > reach / 2 else Hit("empty")


@dataclass(frozen=True)
class Drag:
    """Drag of a point or of the curve.

    Attributes
    ----------
    medium : TransferFunction
        Transfer function at the start.
    at : (x, y)
        Point of the window at the start.
    upright : bool
        True for a drag of the curve that multiplies the opacity.
    widens : bool
        True for a drag of the curve that changes its width.
    """

    medium: TransferFunction
    hit: Hit
    at: tuple[float, float]
    upright: bool = False
    widens: bool = False

    def moved(self, frame: Frame, x: float, y: float, length: float) -> TransferFunction:
        """Return the transfer function with the mouse at (x, y)."""
        if self.hit.kind == "point":
            return self._point_moved(frame, x, y, length)
        if self.hit.kind == "curve" and self.upright:
            return self._denser(frame, y, length)
        low, high = adjusting.ends(self.medium)
        by = frame.value(x) - frame.value(self.at[0])
        if self.hit.kind == "curve" and self.widens:
            factor = float(np.exp((x - self.at[0]) / (_EXTENT * frame.width)))
            return widened(self.medium, frame, frame.value(self.at[0]), factor)
        if self.hit.kind == "curve":
            start = frame.rounded(low + by)
            return _between(self.medium, frame, start, start + (high - low))
        least = _LEAST_WIDTH * (frame.shown[1] - frame.shown[0])
        if self.hit.kind == "low":
            return _between(self.medium, frame, min(low + by, high - min(least, high - low)), high)
        return _between(self.medium, frame, low, max(high + by, low + min(least, high - low)))

    def _point_moved(self, frame: Frame, x: float, y: float, length: float) -> TransferFunction:
        layers = lineage.layers_of(self.medium)
        point = layers.curve.points[self.hit.index]
        before = frame.y(float(opacity_of(point.extinction, length)))
        opacity = frame.opacity(before + y - self.at[1])
        value = frame.rounded(point.value + frame.value(x) - frame.value(self.at[0]))
        stays = np.isinf(point.extinction) and opacity > _OPAQUE_FROM
        extinction = point.extinction if stays else extinction_of(min(opacity, MOST_OPACITY), length)
        if y == self.at[1]:
            extinction = point.extinction
        return lineage.edited(self.medium, layers.with_curve(layers.curve.moved(self.hit.index, value, extinction)))

    def _denser(self, frame: Frame, y: float, length: float) -> TransferFunction:
        """Return the transfer function whose curve is pulled from the start to the mouse."""
        factor = lineage.lineage_of(self.medium).factor
        here = float(opacity_of(self.medium.at(frame.value(self.at[0]))[3], length))
        if _PULLED[0] <= here <= _PULLED[1]:
            there = float(np.clip(here + frame.opacity(y) - frame.opacity(self.at[1]), 0.002, 0.998))
            factor *= extinction_of(there, length) / extinction_of(here, length)
        else:
            factor *= float(np.exp((self.at[1] - y) / (_EXTENT * frame.height)))
        return lineage.adjusted(self.medium, factor=float(f"{min(factor, 1e6):.3g}"))


def widened(medium: TransferFunction, frame: Frame, about: float, factor: float) -> TransferFunction:
    """Return the transfer function with its range multiplied by a factor, about a value that stays."""
    low, high = adjusting.ends(medium)
    least = _LEAST_WIDTH * (frame.shown[1] - frame.shown[0])
    factor = max(factor, min(least / (high - low), 1.0)) if high > low else 1.0
    return _between(medium, frame, about - (about - low) * factor, about + (high - about) * factor)


def notched(notches: float) -> float:
    """Return the factor of the width for notches of the wheel: away from the user is wider."""
    return float(_NOTCH ** np.clip(notches, -10, 10))


def _between(medium: TransferFunction, frame: Frame, low: float, high: float) -> TransferFunction:
    low, high = frame.rounded(low), frame.rounded(high)
    return lineage.adjusted(medium, (low, high)) if low < high else medium
