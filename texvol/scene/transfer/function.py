"""A transfer function takes a value to straight linear colour and extinction per world unit, piecewise linearly.

Between control points both are linear in the value; outside they are those of the nearest point; two points at one
value make a step, whose right side holds at the value itself. Two things may glow:

- *associated* (default): the emission per world unit is colour times extinction; matter shows its own colour.
- *emissive*: the emission is a number of its own, and matter may glow without absorbing (Wilson et al. 1994).
- *premultiplied*: the points hold colour times extinction, and it is this that is linear between them, so that mixtures
  of materials are exact (Drebin, Carpenter, Hanrahan 1988). It is associated: such matter reflects light.

Further matter may depend on the gradient's magnitude |∇f|, too: the points times a factor, and `graded`.

An extinction may be infinite (opacity 1 per unit length): such matter is opaque at any thickness, and so is every
value strictly between its point and the next.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.transfer import pieces
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.transfer.pieces import LARGEST_VALUE, ROUNDING
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.kept_arrays import KeepsArrays, read_only

__all__ = ["LARGEST_VALUE", "Classified", "TransferFunction"]


class Classified(NamedTuple):
    """What the transfer function says of some values."""

    emission: NDArray[np.float64]  # q, per world unit, shape (…, 3); where extinction is infinite: what shows of it
    extinction: NDArray[np.float64]  # τ, per world unit, shape (…)


@dataclass(frozen=True, eq=False)
class TransferFunction(KeepsArrays):
    """Control points (value, colour or emission, extinction), in data and world units.

    Parameters
    ----------
    values : array of shape (n,)
        Never descending; equal neighbours make a step.
    colors : array of shape (n, 3)
        Linear and straight. Associated: in [0, 1]. Emissive and premultiplied: emission per world unit, not negative.
    extinctions : array of shape (n,)
        Per world unit; from 0 to infinity.
    emissive : bool
        Whether `colors` is an emission of its own.
    premultiplied : bool
        Whether `colors` is colour times extinction, the emission of matter that reflects light, interpolated as such;
        at a point of infinite extinction it is the straight colour. Between such a point and a finite one a mixture
        of the two would show: a step parts them.
    modulation : array of shape (m, 2), optional
        Gradient magnitude, data units per world unit, ascending, and what emission and extinction of the points are
        multiplied with there; linear in between, clamped at the ends.
    graded, contours : sequences of Graded and Contour
        Further matter, which depends on the gradient.
    materials : sequence of str
        Names of the materials that it is made of, where it was made of some.
    material_colors : sequence of (r, g, b)
        Their straight colours, in [0, 1]; none, or as many as there are names.

    Raises
    ------
    InputError
        If the points are none, unsorted, not finite, negative or out of range, or the modulation is.
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
    material_colors: tuple[tuple[float, float, float], ...] = ()

    def __post_init__(self) -> None:
        for field in ("values", "colors", "extinctions"):
            object.__setattr__(self, field, read_only(np.array(getattr(self, field), dtype=np.float64)))
        for field in ("graded", "contours", "materials", "material_colors"):
            object.__setattr__(self, field, tuple(getattr(self, field)))
        count = self.values.shape[0] if self.values.ndim == 1 else 0
        if count == 0:
            raise InputError(f"{self.name}: a transfer function has at least one point")
        if self.colors.shape != (count, 3) or self.extinctions.shape != (count,):
            raise InputError(
                f"{self.name}: {count} values need colors of shape ({count}, 3) and {count} extinctions, "
                f"and have {self.colors.shape} and {self.extinctions.shape}"
            )
        self._check_numbers()
        if self.material_colors and len(self.material_colors) != len(self.materials):
            raise InputError(
                f"{self.name}: {len(self.materials)} names of materials have {len(self.material_colors)} colours"
            )
        if self.modulation is not None:
            object.__setattr__(self, "modulation", read_only(_modulation(self.modulation, self.name)))

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
        if self.emissive and self.premultiplied:
            raise InputError(f"{self.name}: points are either emissive or premultiplied")
        if not self.glows and (self.colors > 1).any():
            raise InputError(f"{self.name}: colours lie in [0, 1], and {self.colors.max():g} is among them")

    @classmethod
    def load(
        cls, path: str | os.PathLike[str], volume: Volume | None = None, materials: Sequence[str] | None = None
    ) -> TransferFunction:
        """The transfer function in a JSON file, see `texvol.scene.transfer.files.load`."""
        from texvol.scene.transfer.files import load

        return load(path, volume, materials)

    @property
    def needs_gradient(self) -> bool:
        """Whether any matter depends on the gradient."""
        return self.modulation is not None or bool(self.graded) or bool(self.contours)

    @property
    def _by_gradient(self) -> list[Graded | Contour]:
        return [*self.graded, *self.contours]

    @property
    def glows(self) -> bool:
        """Whether `colors` is the emission, and not a colour that extinction is to be multiplied with."""
        return self.emissive or self.premultiplied

    @property
    def excess_emission(self) -> float:
        """The most by which emission may exceed extinction, per world unit; 0 where no colour is over 1.

        With q <= τ + e matter along a way of length L sheds no more light than 1 + e L, whatever is in front.
        """
        most = 0.0
        if self.glows:
            factor = 1.0 if self.modulation is None else float(self.modulation[:, 1].max())
            most = factor * float((self.colors.max(axis=1) - self.extinctions).max())
        most = max(most, 0.0)
        for graded in self.graded:
            most += max(float((graded.emissions.max(axis=1) - graded.extinctions).max()), 0.0)
        for contour in self.contours:
            most += max(max(contour.emission) - contour.extinction, 0.0)
        return most

    def as_json(self) -> dict[str, Any]:
        """What a transfer-function file holds of it, in data and world units, see `texvol.scene.transfer.writing`."""
        from texvol.scene.transfer.writing import content_of

        return content_of(self)

    def classify(self, values: ArrayLike, magnitudes: ArrayLike | None = None) -> Classified:
        """Emission and extinction of each value; both 0 where the value is NaN.

        Parameters
        ----------
        values : array
        magnitudes : array, optional
            Gradient magnitudes, data units per world unit, that go with the values; NaN counts as 0. Wanted where
            `needs_gradient`, and of no account elsewhere.

        Raises
        ------
        InputError
            If there are no magnitudes and `needs_gradient`.
        """
        if self.needs_gradient and magnitudes is None:
            raise InputError(f"{self.name}: some of it depends on the gradient: give classify(values, magnitudes)")
        numbers = self.at(values)
        colors, extinction = numbers[..., :3], numbers[..., 3]
        if self.emissive:
            # ∫ q T vanishes where T does at once.
            medium = Classified(np.where(np.isinf(extinction)[..., np.newaxis], 0.0, colors), extinction)
        elif self.premultiplied:
            medium = Classified(colors, extinction)
        else:
            # An infinite extinction shows its straight colour.
            weight = np.where(np.isinf(extinction), 1.0, extinction)
            medium = Classified(colors * weight[..., np.newaxis], extinction)
        return self._with_gradient(medium, values, magnitudes) if self.needs_gradient else medium

    def _with_gradient(self, points: Classified, values: ArrayLike, magnitudes: ArrayLike | None) -> Classified:
        """The points' matter times their modulation, and what depends on the gradient."""
        values, magnitudes = np.broadcast_arrays(np.asarray(values, np.float64), np.asarray(magnitudes, np.float64))
        magnitudes = np.where(np.isnan(magnitudes), 0.0, magnitudes)
        emission = np.broadcast_to(points.emission, (*values.shape, 3)).copy()
        extinction = np.broadcast_to(points.extinction, values.shape).copy()
        opaque = np.isinf(extinction)
        if self.modulation is not None:
            factor = np.interp(magnitudes, self.modulation[:, 0], self.modulation[:, 1])
            opaque &= factor > 0
            extinction = np.where(opaque, np.inf, np.where(np.isinf(extinction), 0.0, extinction) * factor)
            # Opaque matter stays as it is, or is gone.
            emission *= np.where(opaque, 1.0, factor)[..., np.newaxis]
        for further in self._by_gradient:
            more_emission, more_extinction = further.at(values, magnitudes)
            emission += np.where(opaque[..., np.newaxis], 0.0, more_emission)
            extinction += more_extinction
        return Classified(emission, extinction)

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

    def shows_between(
        self, lowest: ArrayLike, highest: ArrayLike, largest_magnitude: ArrayLike = np.inf
    ) -> NDArray[np.bool_]:
        """Whether any value from `lowest` to `highest` may be more than nothing; False where either is NaN.

        Gradient magnitudes go from 0 to `largest_magnitude`, data units per world unit. Both ends are widened by what
        rounding may do to a value on its way, where a step is that near.
        """
        lowest, highest = np.asarray(lowest, np.float64), np.asarray(highest, np.float64)
        is_more = self.extinctions > 0
        if self.glows:
            is_more = is_more | (self.colors > 0).any(axis=1)
        shows = pieces.shows_between(self.values, is_more, np.isinf(self.extinctions), lowest, highest)
        if self.modulation is not None:
            shows = shows & self._may_modulate(largest_magnitude)
        for further in self._by_gradient:
            shows = shows | further.shows_between(lowest, highest, largest_magnitude)
        return shows

    def _may_modulate(self, largest_magnitude: ArrayLike) -> NDArray[np.bool_]:
        """Whether any gradient magnitude from 0 to the largest leaves something of the points."""
        assert self.modulation is not None
        first = np.flatnonzero(self.modulation[:, 1] > 0)
        largest = np.asarray(largest_magnitude, np.float64) * (1 + ROUNDING)
        if not first.size:
            return np.zeros(largest.shape, np.bool_)
        # The factor rises from the last 0 before it.
        return np.asarray(largest > self.modulation[first[0] - 1, 0] if first[0] else largest >= 0)

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
        left, _, opaque = self.segment_ends
        level = np.zeros((1, 4))  # the two outer segments
        slope = np.vstack([level, pieces.slopes(self.values, self.numbers), level])
        return self.values[left], self.numbers[left], slope, opaque


def _modulation(pairs: ArrayLike, name: str) -> NDArray[np.float64]:
    modulation = np.array(pairs, np.float64)
    if modulation.ndim != 2 or modulation.shape[1] != 2 or not len(modulation):
        raise InputError(f"{name}: gradient is a list of pairs [magnitude, factor], and has shape {modulation.shape}")
    if not ((modulation >= 0) & np.isfinite(modulation)).all():
        raise InputError(f"{name}: gradient magnitudes and factors must be finite and not negative")
    fallen = np.flatnonzero(np.diff(modulation[:, 0]) <= 0)
    if fallen.size:
        before, after = modulation[fallen[0] : fallen[0] + 2, 0]
        raise InputError(f"{name}: gradient magnitudes must ascend, and {after:g} follows {before:g}")
    return modulation


# Transfer function of pictures of the values themselves, in which nothing is classified.
NO_MEDIUM = TransferFunction(np.zeros(1), np.zeros((1, 3)), np.zeros(1))
