"""A transfer function takes a value to straight linear colour and extinction per world unit, piecewise linearly.

Between control points both are linear in the value; outside they are those of the nearest point; two points at one
value make a step, whose right side holds at the value itself. Two things may glow:

- *associated* (default): the emission per world unit is colour times extinction; matter shows its own colour.
- *emissive*: the emission is a number of its own, and matter may glow without absorbing (Wilson et al. 1994).

An extinction may be infinite (opacity 1 per unit length): such matter is opaque at any thickness, and so is every
value strictly between its point and the next.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.errors import InputError
from texvol.transfer.graded import Contour, Graded
from texvol.volume import Volume

LARGEST_VALUE = 8e307
_ROUNDING = 2.0**-20  # of a value, more than interpolation loses


class Classified(NamedTuple):
    """What the transfer function says of some values."""

    emission: NDArray[np.float64]  # q, per world unit, shape (…, 3); where extinction is infinite: what shows of it
    extinction: NDArray[np.float64]  # τ, per world unit, shape (…)


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """Control points (value, colour or emission, extinction), in data and world units.

    Parameters
    ----------
    values : array of shape (n,)
        Never descending; equal neighbours make a step.
    colors : array of shape (n, 3)
        Linear and straight. Associated: in [0, 1]. Emissive: emission per world unit, not negative.
    extinctions : array of shape (n,)
        Per world unit; from 0 to infinity.
    emissive : bool
        Whether `colors` is an emission of its own.
    premultiplied : bool
        Whether `colors` is colour times extinction, the emission of matter that reflects light, interpolated as such;
        at a point of infinite extinction it is the straight colour.
    modulation : array of shape (m, 2), optional
        Gradient magnitude, data units per world unit, ascending, and what emission and extinction of the points are
        multiplied with there; linear in between, clamped at the ends.
    graded, contours : sequences of Graded and Contour
        Further matter, which depends on the gradient.
    materials : sequence of str
        Names of the materials that it is made of, where it was made of some.

    Raises
    ------
    InputError
        If the points are none, unsorted, not finite, negative or out of range.
    """

    values: NDArray[np.float64]
    colors: NDArray[np.float64]
    extinctions: NDArray[np.float64]
    emissive: bool = False
    name: str = "transfer function"
    premultiplied: bool = False
    modulation: NDArray[np.float64] | None = None
    graded: tuple[Graded, ...] = ()
    contours: tuple[Contour, ...] = ()
    materials: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for field in ("values", "colors", "extinctions"):
            object.__setattr__(self, field, np.array(getattr(self, field), dtype=np.float64))
        count = self.values.shape[0] if self.values.ndim == 1 else 0
        if count == 0:
            raise InputError(f"{self.name}: a transfer function has at least one point")
        if self.colors.shape != (count, 3) or self.extinctions.shape != (count,):
            raise InputError(
                f"{self.name}: {count} values need colors of shape ({count}, 3) and {count} extinctions, "
                f"and have {self.colors.shape} and {self.extinctions.shape}"
            )
        self._check_numbers()

    def _check_numbers(self) -> None:
        if not np.isfinite(self.values).all():
            raise InputError(f"{self.name}: values must be finite")
        if np.abs(self.values).max() > LARGEST_VALUE:
            raise InputError(
                f"{self.name}: values must lie within {LARGEST_VALUE:g}: their differences are to be numbers"
            )
        if (np.diff(self.values) < 0).any():
            first = int(np.argmax(np.diff(self.values) < 0))
            raise InputError(
                f"{self.name}: values must ascend, and {self.values[first + 1]:g} follows {self.values[first]:g}"
            )
        if not (self.extinctions >= 0).all():  # NaN fails this too
            raise InputError(f"{self.name}: extinction must not be negative or NaN")
        if not np.isfinite(self.colors).all() or (self.colors < 0).any():
            raise InputError(f"{self.name}: colours must be finite and not negative")
        if not self.emissive and (self.colors > 1).any():
            raise InputError(f"{self.name}: colours lie in [0, 1], and {self.colors.max():g} is among them")

    @classmethod
    def load(cls, path: str | os.PathLike[str], volume: Volume | None = None) -> TransferFunction:
        """The transfer function in a JSON file, see `texvol.transfer.files.load`."""
        from texvol.transfer.files import load

        return load(path, volume)

    @property
    def needs_gradient(self) -> bool:
        """Whether any matter depends on the gradient."""
        return self.modulation is not None or bool(self.graded) or bool(self.contours)

    @property
    def glows(self) -> bool:
        """Whether `colors` is the emission, and not a colour that extinction is to be multiplied with."""
        return self.emissive or self.premultiplied

    def as_json(self) -> dict[str, Any]:
        """The points as a transfer-function file holds them; infinite extinction as opacity 1."""
        points: list[dict[str, Any]] = []
        for value, color, extinction in zip(self.values, self.colors, self.extinctions, strict=True):
            point = {"value": float(value), "emission" if self.emissive else "color": color.tolist()}
            weight = {"opacity": 1.0} if np.isinf(extinction) else {"extinction": float(extinction)}
            points.append(point | weight)
        return {"points": points} | ({"emission": "emissive"} if self.emissive else {})

    def classify(self, values: ArrayLike) -> Classified:
        """Emission and extinction of each value; both 0 where the value is NaN."""
        numbers = self.at(values)
        colors, extinction = numbers[..., :3], numbers[..., 3]
        if self.emissive:
            # ∫ q T vanishes where T does at once.
            return Classified(np.where(np.isinf(extinction)[..., np.newaxis], 0.0, colors), extinction)
        # An infinite extinction shows its straight colour.
        weight = np.where(np.isinf(extinction), 1.0, extinction)
        return Classified(colors * weight[..., np.newaxis], extinction)

    def at(self, values: ArrayLike) -> NDArray[np.float64]:
        """Straight colour (or emission) and extinction of each value, shape (…, 4); all 0 where the value is NaN."""
        values = np.asarray(values, dtype=np.float64)
        absent = np.isnan(values)
        segment = np.searchsorted(self.values, values, side="right")  # number of points at or below the value
        start, base, slope, opaque = self._lines
        # Beyond the outer points nothing changes; clipped, infinite values are finite.
        offset = np.clip(values, self.values[0], self.values[-1]) - start.take(segment)
        # take is ten times as fast as an index; a fused update in place saves as much again.
        numbers = slope.take(segment, axis=0)
        numbers *= offset[..., np.newaxis]
        numbers += base.take(segment, axis=0)
        np.maximum(numbers, 0.0, out=numbers)  # rounding may leave -1e-17 where a point of 0 is reached
        if opaque.any():
            # An infinite point holds from itself on, and above the point before it.
            hidden = opaque[segment, 0] | (opaque[segment, 1] & (offset > 0))
            numbers[..., 3] = np.where(hidden, np.inf, numbers[..., 3])
        if absent.any():
            numbers[absent] = 0.0
        return numbers

    def shows_between(self, lowest: ArrayLike, highest: ArrayLike) -> NDArray[np.bool_]:
        """Whether any value from `lowest` to `highest` is more than nothing; False where either is NaN.

        Both ends are widened by what rounding may do to a value on its way, where a step is that near.
        """
        lowest, highest = np.asarray(lowest, np.float64), np.asarray(highest, np.float64)
        weight = np.column_stack([self.colors, self.extinctions]) if self.emissive else self.extinctions[:, np.newaxis]
        is_more = np.asarray(np.any(weight > 0, axis=1))
        opaque = np.isinf(self.extinctions)
        # On a line from 0 a rounding is nothing; beside an infinite point the values up to its neighbours are opaque.
        point_shows = is_more.copy()
        point_shows[:-1] |= opaque[1:]
        point_shows[1:] |= opaque[:-1]
        with np.errstate(invalid="ignore", over="ignore"):
            below = np.where(np.isfinite(lowest), lowest - _ROUNDING * np.abs(lowest), lowest)
            above = np.where(np.isfinite(highest), highest + _ROUNDING * np.abs(highest), highest)
        first = np.searchsorted(self.values, below, side="left")
        last = np.searchsorted(self.values, above, side="right")
        before = np.concatenate([[0], np.cumsum(point_shows)])
        shows: NDArray[np.bool_] = np.asarray(before[np.maximum(first, last)] > before[first])
        # Without a point between them, both ends lie on one line, which is 0 throughout or but for its end.
        left = np.searchsorted(self.values, lowest, side="right")
        line_shows = np.concatenate([is_more[:1], is_more[:-1] | is_more[1:], is_more[-1:]])
        at_start = np.maximum(left - 1, 0)
        shows |= line_shows[left] & ((highest > self.values[at_start]) | is_more[at_start] | (left == 0))
        # Or the last of the points ends in a line that the higher end is on.
        left = np.searchsorted(self.values, highest, side="right")
        at_start = np.maximum(left - 1, 0)
        shows |= line_shows[left] & ((highest > self.values[at_start]) | is_more[at_start])
        return shows & ~(np.isnan(lowest) | np.isnan(highest))

    @cached_property
    def numbers(self) -> NDArray[np.float64]:
        """Colour and extinction of each point, shape (n, 4); 0 for the extinction of an opaque one."""
        return np.column_stack([self.colors, np.where(np.isinf(self.extinctions), 0.0, self.extinctions)])

    @cached_property
    def segment_ends(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_]]:
        """Points at the left and the right of each segment, and whether they are opaque, shape (n + 1, 2).

        Segment s has s points at or below it; the first and the last have the outer point at both ends.
        """
        segments = np.arange(self.values.size + 1)
        left, right = np.maximum(segments - 1, 0), np.minimum(segments, self.values.size - 1)
        infinite = np.isinf(self.extinctions)
        return left, right, np.column_stack([infinite[left], infinite[right]])

    @cached_property
    def _lines(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """Each segment as a line: start, numbers there, numbers per unit of value, and which ends are opaque."""
        left, right, opaque = self.segment_ends
        width = self.values[right] - self.values[left]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            slope = (self.numbers[right] - self.numbers[left]) / width[:, np.newaxis]
        slope[~np.isfinite(slope)] = 0.0  # steps, and the two outer segments
        return self.values[left], self.numbers[left], slope, opaque
