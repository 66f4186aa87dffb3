"""A Pair: two pictures of one size whose difference is to be explained.

A hypothesis is undone by changing one of the two pictures, which makes another pair. The fraction of the squared
difference that disappears is what the hypothesis explains.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float32]
SIDES = ("candidate", "reference")

# Weights of grey with which no two channels cancel.
GREY = np.array([0.9, 1.0, 1.1, 0.8], np.float32)
# Pixels of a sample from each stratum: parameters fitted to some thousand pixels are known to a hundredth of the
# pixels' scatter, and powers of the pixels take a tenth of a millisecond.
_STRATUM = 700
_WINDOW = 256
# Both pictures are sums in float32: a rounding is 2^-24 of the value, and a dozen roundings are 1e-6; with hundreds of
# slabs some pixels have ten times as much.
ROUNDING, _WORST_ROUNDING = 1e-6, 1e-5
# Sums of squared roundings scatter by a few hundredths if steps are not small against the content; the weights of
# interpolation by eight pixels sum to at most 1.9.
_OF_FLOOR, _OF_ALLOWANCE = 1.25, 2.0
_SURELY_BEYOND = 1.1  # times the allowance, which leaves out products of roundings
_LEAST_BEYOND = 0.02  # of the squared difference; less is like rounding


@dataclass(frozen=True, eq=False)
class Pair:
    """Candidate and reference, (height, width, 4) float32, finite, premultiplied, linear.

    Attributes
    ----------
    has_opacity : bool
        False if the fourth channel is 1 in both and means nothing.
    corner : (column, row)
        Position of the first pixel in the original pictures.
    weights : array of shape (height, width), optional
        Number of pixels of the original pictures that each pixel represents.
    roundings : pair of arrays of shape (height, width, 4), optional
        Half a step of either picture's number format at each number.
    """

    candidate: Pixels
    reference: Pixels
    has_opacity: bool = True
    corner: tuple[int, int] = (0, 0)
    weights: NDArray | None = None
    roundings: tuple[Pixels, Pixels] | None = None

    @cached_property
    def difference(self) -> Pixels:
        """Candidate - reference."""
        with np.errstate(over="ignore", invalid="ignore"):
            return self.candidate - self.reference

    @cached_property
    def largest(self) -> float:
        """Largest absolute difference; infinite if undoing a hypothesis made it NaN."""
        low, high = float(self.difference.min()), float(self.difference.max())
        return max(-low, high) if np.isfinite(low + high) else np.inf

    @cached_property
    def energy(self) -> Pixels:
        """Squared difference of each pixel in units of the largest difference squared, so that no square overflows."""
        scaled = self.difference * np.float32(1 / max(self.largest, 1e-30))
        return np.einsum("hwc,hwc->hw", scaled, scaled)

    @cached_property
    def total(self) -> float:
        """Sum of squared differences, float64."""
        if not np.isfinite(self.largest):
            return np.inf
        energy = self.energy if self.weights is None else self.energy * self.weights
        return float(energy.sum(dtype=np.float64)) * self.largest**2

    @cached_property
    def scale(self) -> float:
        """Largest absolute value of either picture."""
        return max(float(max(each.max(), -each.min())) for each in (self.candidate, self.reference))

    @cached_property
    def allowance(self) -> Pixels | None:
        """Largest difference that rounding makes of two equal numbers; None if neither picture was rounded."""
        return None if self.roundings is None else self.roundings[0] + self.roundings[1]

    @cached_property
    def floor(self) -> float:
        """Squared difference that rounding makes on average: q² / 3 for each step of 2q."""
        if self.roundings is None:
            return 0.0
        squares = sum(np.square(each, dtype=np.float64) for each in self.roundings)
        return float((np.where(self.difference != 0, squares, 0).sum(axis=2) * self.pixel_weights).sum() / 3)

    @property
    def beyond_floor(self) -> float:
        """Squared difference beyond the mean of rounding."""
        return max(self.total - self.floor, 0.0)

    @property
    def is_within_allowance(self) -> bool:
        """True if no number differs by more than rounding can explain."""
        if self.allowance is None:
            return False
        return bool((np.abs(self.difference) <= self.allowance * (1 + ROUNDING) + ROUNDING * self.scale).all())

    @property
    def is_format(self) -> bool:
        """True if the rest is of rounding's size, and nowhere much larger.

        Interpolated or scaled pictures hold roundings of their neighbours, with weights of either sign.
        """
        if self.allowance is None or self.total > _OF_FLOOR * self.floor:
            return False
        return bool((np.abs(self.difference) <= _OF_ALLOWANCE * self.allowance + ROUNDING * self.scale).all())

    @cached_property
    def beyond(self) -> Pair:
        """Return the pair whose difference is the part beyond the rounding of each number."""
        if self.allowance is None:
            return self
        difference = self.difference
        beyond = np.copysign(np.maximum(np.abs(difference) - _SURELY_BEYOND * self.allowance, 0), difference)
        return replace(self, candidate=self.reference + beyond, roundings=None)

    @property
    def is_rounding(self) -> bool:
        """True if sums in float32 explain the difference."""
        if not self.largest <= _WORST_ROUNDING * self.scale:
            return False
        return self.largest <= ROUNDING * self.scale or self.total <= self.energy.size * (ROUNDING * self.scale) ** 2

    @property
    def pixel_weights(self) -> NDArray:
        """Number of original pixels that each pixel represents, (height, width)."""
        return np.ones(self.candidate.shape[:2]) if self.weights is None else self.weights

    @property
    def channels(self) -> int:
        """Number of channels that mean something."""
        return 4 if self.has_opacity else 3

    @property
    def size(self) -> tuple[int, int]:
        """Size of the pictures, (width, height)."""
        return self.candidate.shape[1], self.candidate.shape[0]

    def of(self, side: str) -> Pixels:
        """Return the "candidate" or the "reference"."""
        return self.candidate if side == "candidate" else self.reference

    def with_side(self, side: str, pixels: Pixels, rounding: Pixels | None = None) -> Pair:
        """Return the pair with another picture on one side; `rounding` replaces that side's rounding."""
        roundings = self.roundings
        if roundings is not None and rounding is not None:
            roundings = (rounding, roundings[1]) if side == "candidate" else (roundings[0], rounding)
        changed: dict[str, Any] = {side: pixels, "roundings": roundings}
        return replace(self, **changed)

    def rounding_of(self, side: str) -> Pixels | None:
        """Half a step of one side's number format at each number."""
        return None if self.roundings is None else self.roundings[side == "reference"]

    def part(self, rows: slice, columns: slice) -> Pair:
        """Return a rectangle of the pair."""
        corner = (self.corner[0] + columns.start, self.corner[1] + rows.start)
        roundings = self.roundings and (self.roundings[0][rows, columns], self.roundings[1][rows, columns])
        pixels = self.candidate[rows, columns], self.reference[rows, columns]
        return Pair(*pixels, self.has_opacity, corner, roundings=roundings)

    def explained_by(self, undone: Pair) -> float:
        """Fraction of the squared difference that is gone in `undone`; negative if there is more.

        If the difference exceeds that of rounding, which no hypothesis undoes, only the excess counts.
        """
        before, after = self.beyond_floor, undone.beyond_floor
        if self.roundings is None or before <= _LEAST_BEYOND * self.total:
            return self.all_explained_by(undone)
        fraction = min(1 - after / before, self._along(undone) / max(self.signal, 1e-300))
        return fraction if np.isfinite(fraction) else -np.inf

    @cached_property
    def signal(self) -> float:
        """Squared difference before rounding, estimated from the sum; at most `total`.

        If one picture was rounded, its errors are added. If both were rounded and differed by δ, a fraction δ / 2q of
        the pixels differs by a step of 2q: mean d² = δ² + 2qδ.
        """
        if self.roundings is None:
            return self.total
        if not all(each.any() for each in self.roundings):
            return self.beyond_floor
        weights = np.broadcast_to(self.pixel_weights[..., np.newaxis], self.difference.shape)
        squares = weights * np.square(self.difference, dtype=np.float64)
        allowance = self.roundings[0] + self.roundings[1]
        far = np.abs(self.difference) > _SURELY_BEYOND * allowance
        count = max(float(weights[~far].sum()), 1.0)
        step = float((allowance * weights)[~far].sum() / count)
        near = count * (np.sqrt(float(squares[~far].sum()) / count + step**2 / 4) - step / 2) ** 2
        return near + float(squares[far].sum())

    def _along(self, undone: Pair) -> float:
        """Squared difference along the undone part: a small undone part explains little."""
        if undone.difference.shape != self.difference.shape:
            return np.inf
        difference = self.difference.astype(np.float64)
        change = difference - undone.difference
        weights = self.pixel_weights[..., np.newaxis]
        squares = float((weights * change * change).sum())
        return float((weights * difference * change).sum()) ** 2 / squares if squares > 0 else 0.0

    def all_explained_by(self, undone: Pair) -> float:
        """Fraction of the whole squared difference, rounding included, that is gone in `undone`."""
        fraction = 1 - undone.total / self.total if self.total > 0 else 0.0
        return fraction if np.isfinite(fraction) else -np.inf

    @cached_property
    def sample(self) -> Pair:
        """Some thousand pixels in one row, weighted by the number of pixels that each represents.

        Equal pixels, different pixels, and pixels that differ by more than the rms are sampled evenly each, so that a
        small part with large differences is not missed.
        """
        if self.weights is not None:
            return self
        energy = self.energy.ravel()
        mean = energy.mean(dtype=np.float64)
        equal, much = energy <= 0, energy > mean
        chosen, weights = [], []
        for stratum in (equal, ~equal & ~much, much):
            found = np.flatnonzero(stratum)
            taken = found[np.linspace(0, len(found) - 1, min(len(found), _STRATUM)).astype(np.int64)]
            chosen.append(taken)
            weights.append(np.full(len(taken), len(found) / max(len(taken), 1)))
        index = np.concatenate(chosen)
        arrays = (self.candidate, self.reference, *(self.roundings or ()))
        row = [each.reshape(-1, 4)[index][np.newaxis] for each in arrays]
        roundings = (row[2], row[3]) if self.roundings is not None else None
        return Pair(row[0], row[1], self.has_opacity, weights=np.concatenate(weights)[np.newaxis], roundings=roundings)

    @cached_property
    def window(self) -> Pair:
        """Small part of the pair that differs most; a hypothesis that fails there fails."""
        width, height = self.size
        columns, rows = min(width, _WINDOW), min(height, _WINDOW)
        if (columns, rows) == (width, height):
            return self
        top, left = (
            _most(self.energy.sum(axis=axis, dtype=np.float64), side) for axis, side in ((1, rows), (0, columns))
        )
        return self.part(slice(top, top + rows), slice(left, left + columns))


def other(side: str) -> str:
    """Return "reference" for "candidate", and the reverse."""
    return "reference" if side == "candidate" else "candidate"


def _most(along: NDArray, length: int) -> int:
    """Return the start of the run of `length` with the largest sum."""
    sums = np.cumsum(np.append(0, along))
    return int((sums[length:] - sums[:-length]).argmax())
