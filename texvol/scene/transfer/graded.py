"""Matter that depends on the gradient: its emission and extinction, by value and gradient magnitude |∇f|.

    Graded    points by value, times clamp((|∇f| - start) / (full - start), 0, 1)
    Contour   Levoy's isovalue contour (1988): a medium times max(0, 1 - |f - value| / (thickness |∇f|))

Both are premultiplied: what they add to the emission q and the extinction τ of a position. A value that is NaN has
neither, and a gradient that is NaN counts as none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from texvol.scene.transfer import pieces
from texvol.scene.transfer.pieces import LARGEST_VALUE, ROUNDING, Flags, Numbers
from texvol.util.errors import InputError
from texvol.util.kept_arrays import KeepsArrays, read_only

Medium = tuple[Numbers, Numbers]  # emission (…, 3) and extinction (…), per world unit


@dataclass(frozen=True, eq=False)
class Graded(KeepsArrays):
    """Points by value, piecewise linear, nothing before the first and after the last, times a ramp in |∇f|.

    Where the ends of the ramp are equal it is a step, 1 from there on.

    Raises
    ------
    InputError
        If there are no points, or they are unsorted, not finite or negative, or the ramp falls.
    """

    # Data units, shape (n,), never descending; equal neighbours make a step, whose right side holds at the value.
    values: Numbers
    emissions: Numbers  # q per world unit, shape (n, 3)
    extinctions: Numbers  # τ per world unit, finite, shape (n,)
    start: float  # gradient magnitude, data units per world unit, from which the weight rises from 0 …
    full: float  # … and at which it reaches 1

    def __post_init__(self) -> None:
        for field in ("values", "emissions", "extinctions"):
            object.__setattr__(self, field, read_only(np.array(getattr(self, field), dtype=np.float64)))
        count = self.values.size
        shapes = self.values.shape, self.emissions.shape, self.extinctions.shape
        if count == 0 or shapes != ((count,), (count, 3), (count,)):
            raise InputError(
                "graded medium must have n values, emissions of shape (n, 3) and n extinctions, with n at least 1, "
                f"got {', '.join(map(str, shapes))}"
            )
        if not (np.abs(self.values) <= LARGEST_VALUE).all():
            raise InputError(f"graded medium: values must be finite and at most {LARGEST_VALUE:g} in size")
        pieces.check_ascending(self.values, "graded medium: values", steps=True)
        for what, numbers in (("emission", self.emissions), ("extinction", self.extinctions)):
            if not ((numbers >= 0) & np.isfinite(numbers)).all():
                raise InputError(f"graded medium: {what} must be finite and not negative")
        if not (np.isfinite([self.start, self.full]).all() and 0 <= self.start <= self.full):
            raise InputError(
                "graded medium: the gradient range must rise from at least 0, got "
                f"{float(self.start):g} to {float(self.full):g}"
            )

    def weights(self, values: ArrayLike, magnitudes: ArrayLike) -> Numbers:
        """The ramp at each gradient magnitude; 0 where the value is NaN or lies beyond the points."""
        values, magnitudes = _both(values, magnitudes)
        if self.full > self.start:
            ramp = np.clip((magnitudes - self.start) / (self.full - self.start), 0.0, 1.0)
        else:
            ramp = (magnitudes >= self.start).astype(np.float64)
        held = (values >= self.values[0]) & (values <= self.values[-1])
        return np.where(held, ramp, 0.0)

    def at(self, values: ArrayLike, magnitudes: ArrayLike) -> Medium:
        """Emission, shape (…, 3), and extinction, shape (…), of values and gradient magnitudes, per world unit."""
        values = np.asarray(values, np.float64)
        known = np.where(np.isnan(values), self.values[0], values)  # the weight is 0 there
        numbers = pieces.sides(self.values, np.column_stack([self.emissions, self.extinctions]), known)
        numbers = np.maximum(numbers, 0.0) * self.weights(values, magnitudes)[..., np.newaxis]
        return numbers[..., :3], numbers[..., 3]

    def shows_between(self, lowest: Numbers, highest: Numbers, largest_magnitude: ArrayLike) -> Flags:
        """True where any value from `lowest` to `highest` may show, for gradients up to `largest_magnitude`."""
        more = (self.extinctions > 0) | (self.emissions > 0).any(axis=1)
        # Beyond the outer points is nothing: a step to 0 at either end.
        values = np.concatenate([self.values[:1], self.values, self.values[-1:]])
        more = np.concatenate([[False], more, [False]])
        rises = np.asarray(largest_magnitude, np.float64) * (1 + ROUNDING)
        reached = rises > self.start if self.full > self.start else rises >= self.start
        return pieces.shows_between(values, more, np.zeros_like(more), lowest, highest) & reached


@dataclass(frozen=True)
class Contour:
    """Matter of a surface of one value; `thickness` in world units; where |∇f| is 0, only the value itself counts.

    Raises
    ------
    InputError
        If a number is not finite, negative, or the thickness 0.
    """

    value: float
    thickness: float
    emission: tuple[float, float, float]  # q per world unit
    extinction: float  # τ per world unit, finite

    def __post_init__(self) -> None:
        emission = np.asarray(self.emission, np.float64)
        if emission.shape != (3,) or not ((emission >= 0) & np.isfinite(emission)).all():
            raise InputError(f"contour: emission must be three finite numbers of at least 0, got {self.emission!r}")
        object.__setattr__(self, "emission", tuple(emission.tolist()))
        if not abs(self.value) <= LARGEST_VALUE:
            raise InputError(f"contour: value must be finite and at most {LARGEST_VALUE:g} in size")
        if not 0 < self.thickness < np.inf:
            raise InputError(f"contour: thickness must be a finite number above 0, got {self.thickness:g}")
        if not 0 <= self.extinction < np.inf:
            raise InputError(f"contour: extinction must be finite and not negative, got {self.extinction:g}")

    def weights(self, values: ArrayLike, magnitudes: ArrayLike) -> Numbers:
        """max(0, 1 - |f - value| / (thickness |∇f|)); where |∇f| is 0, 1 for the value itself."""
        values, magnitudes = _both(values, magnitudes)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            away = np.abs(values - self.value)
            weight = np.maximum(1.0 - away / (self.thickness * magnitudes), 0.0)
        return np.where(away == 0, 1.0, np.where(np.isfinite(values), np.nan_to_num(weight), 0.0))

    def at(self, values: ArrayLike, magnitudes: ArrayLike) -> Medium:
        """Emission, shape (…, 3), and extinction, shape (…), of values and gradient magnitudes, per world unit."""
        weights = self.weights(values, magnitudes)
        return weights[..., np.newaxis] * np.array(self.emission), weights * self.extinction

    def shows_between(self, lowest: Numbers, highest: Numbers, largest_magnitude: ArrayLike) -> Flags:
        """True where any value from `lowest` to `highest` may show, for gradients up to `largest_magnitude`."""
        if self.extinction == 0 and not any(self.emission):
            return np.zeros(np.broadcast(lowest, highest, largest_magnitude).shape, np.bool_)
        with np.errstate(invalid="ignore", over="ignore"):
            away = np.maximum(np.maximum(lowest - self.value, self.value - highest), 0.0)
            lost = ROUNDING * np.maximum(np.maximum(np.abs(lowest), np.abs(highest)), abs(self.value))
            reach = self.thickness * (1 + ROUNDING) * np.asarray(largest_magnitude, np.float64)
            return np.asarray(away - lost <= reach)  # NaN fails this


def _both(values: ArrayLike, magnitudes: ArrayLike) -> tuple[Numbers, Numbers]:
    """Return both as arrays, with 0 for gradient magnitudes that are NaN."""
    magnitudes = np.asarray(magnitudes, np.float64)
    return np.asarray(values, np.float64), np.where(np.isnan(magnitudes), 0.0, magnitudes)
