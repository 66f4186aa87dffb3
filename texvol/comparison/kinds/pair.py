"""A Pair is two pictures of one size whose difference is to be explained.

A hypothesis is undone by changing one of the two, which makes another pair; what goes away of the squared difference is
what the hypothesis explains.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.float32]

# Grey, in which no two channels cancel each other.
GREY = np.array([0.9, 1.0, 1.1, 0.8], np.float32)
# Pixels of a sample from each stratum: errors of what is fitted to some thousand pixels are a hundredth of their
# scatter, and powers of them take a tenth of a millisecond.
_STRATUM = 700
_WINDOW = 256
# Both pictures went through sums in float32: a rounding is 2^-24 of the value, and a dozen of them 1e-6; of hundreds of
# slabs some pixels get ten times as much.
ROUNDING, _WORST_ROUNDING = 1e-6, 1e-5
# Sums of squared roundings scatter by a few hundredths where steps are not small against what is shown; interpolation
# by eight pixels sums weights of up to 1.9 at the worst.
_OF_FLOOR, _OF_ALLOWANCE = 1.25, 2.0
_SURELY_BEYOND = 1.1  # of the allowance: products of roundings are a little more
_LEAST_BEYOND = 0.02  # of the squared difference: less can't be told from rounding


@dataclass(frozen=True, eq=False)
class Pair:
    """A candidate and a reference, (height, width, 4) float32, finite, premultiplied, linear.

    Attributes
    ----------
    has_opacity : bool
        Whether the fourth channel says anything; without, it is 1 in both.
    corner : (column, row)
        Where the first pixel lies in the pictures that came.
    weights : array of shape (height, width), optional
        How many pixels of the pictures each one stands for.
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
        """The largest absolute difference, or infinity where what was undone left no number."""
        low, high = float(self.difference.min()), float(self.difference.max())
        return max(-low, high) if np.isfinite(low + high) else np.inf

    @cached_property
    def energy(self) -> Pixels:
        """Squared difference of each pixel, in units of the square of the largest, so that none overflows."""
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
        """The largest absolute value of either picture."""
        return float(max(abs(each) for picture in (self.candidate, self.reference) for each in _extremes(picture)))

    @cached_property
    def allowance(self) -> Pixels | None:
        """What rounding both pictures makes of no difference at most; None where neither was rounded."""
        return None if self.roundings is None else self.roundings[0] + self.roundings[1]

    @cached_property
    def floor(self) -> float:
        """The squared difference that rounding makes: q² / 3 of each step of 2q, where it makes any."""
        if self.roundings is None:
            return 0.0
        squares = sum(np.square(each, dtype=np.float64) for each in self.roundings)
        return float((np.where(self.difference != 0, squares, 0).sum(axis=2) * self.pixel_weights).sum() / 3)

    @property
    def beyond_floor(self) -> float:
        """The squared difference that rounding does not explain, by its sum."""
        return max(self.total - self.floor, 0.0)

    @property
    def is_within_allowance(self) -> bool:
        """Whether no number differs by more than rounding can."""
        if self.allowance is None:
            return False
        return bool((np.abs(self.difference) <= self.allowance * (1 + ROUNDING) + ROUNDING * self.scale).all())

    @property
    def is_format(self) -> bool:
        """Whether what is left is as much as rounding leaves, and nowhere much more.

        What was interpolated or scaled has roundings of its neighbours in it, with weights of either sign.
        """
        if self.allowance is None or self.total > _OF_FLOOR * self.floor:
            return False
        return bool((np.abs(self.difference) <= _OF_ALLOWANCE * self.allowance + ROUNDING * self.scale).all())

    @cached_property
    def beyond(self) -> Pair:
        """The pair whose difference is what is beyond the rounding of each number."""
        if self.allowance is None:
            return self
        difference = self.difference
        beyond = np.copysign(np.maximum(np.abs(difference) - _SURELY_BEYOND * self.allowance, 0), difference)
        return replace(self, candidate=self.reference + beyond, roundings=None)

    @property
    def is_rounding(self) -> bool:
        """Whether sums in float32 explain the difference."""
        if not self.largest <= _WORST_ROUNDING * self.scale:
            return False
        return self.largest <= ROUNDING * self.scale or self.total <= self.energy.size * (ROUNDING * self.scale) ** 2

    @property
    def pixel_weights(self) -> NDArray:
        """How many pixels of the pictures each one stands for, (height, width)."""
        return np.ones(self.candidate.shape[:2]) if self.weights is None else self.weights

    @property
    def channels(self) -> int:
        """How many channels say something."""
        return 4 if self.has_opacity else 3

    @property
    def size(self) -> tuple[int, int]:
        """(width, height)."""
        return self.candidate.shape[1], self.candidate.shape[0]

    def of(self, side: str) -> Pixels:
        """The "candidate" or the "reference"."""
        return self.candidate if side == "candidate" else self.reference

    def with_side(self, side: str, pixels: Pixels, rounding: Pixels | None = None) -> Pair:
        """A pair in which one of the two is another; `rounding` is that one's, if it is another too."""
        roundings = self.roundings
        if roundings is not None and rounding is not None:
            roundings = (rounding, roundings[1]) if side == "candidate" else (roundings[0], rounding)
        if side == "candidate":
            return replace(self, candidate=pixels, roundings=roundings)
        return replace(self, reference=pixels, roundings=roundings)

    def rounding_of(self, side: str) -> Pixels | None:
        """Half a step at each number of one of the two."""
        return None if self.roundings is None else self.roundings[side == "reference"]

    def part(self, rows: slice, columns: slice) -> Pair:
        """A rectangle of it."""
        corner = (self.corner[0] + columns.start, self.corner[1] + rows.start)
        roundings = self.roundings and (self.roundings[0][rows, columns], self.roundings[1][rows, columns])
        pixels = self.candidate[rows, columns], self.reference[rows, columns]
        return Pair(*pixels, self.has_opacity, corner, roundings=roundings)

    def explained_by(self, undone: Pair) -> float:
        """Share of the squared difference that is gone in `undone`; negative where there is more.

        Of what is beyond that of rounding, which nothing undoes, as long as there is something beyond it.
        """
        before, after = self.beyond_floor, undone.beyond_floor
        if self.roundings is None or before < _LEAST_BEYOND * self.total:
            return self.all_explained_by(undone)
        fraction = min(1 - after / before, self._along(undone) / max(self.signal, 1e-300))
        return fraction if np.isfinite(fraction) else -np.inf

    @cached_property
    def signal(self) -> float:
        """The squared difference that there was before rounding, as far as its sum tells; at most `total`.

        Where one picture was rounded its errors are added. Where both were, and differed by δ, δ / 2q of the pixels
        differ by a step of 2q: mean d² = δ² + 2qδ.
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
        """The squared difference that lies along what was undone: what is small undoes little, whatever it leaves."""
        if undone.difference.shape != self.difference.shape:
            return np.inf
        difference = self.difference.astype(np.float64)
        change = difference - undone.difference
        weights = self.pixel_weights[..., np.newaxis]
        squares = float((weights * change * change).sum())
        return float((weights * difference * change).sum()) ** 2 / squares if squares > 0 else 0.0

    def all_explained_by(self, undone: Pair) -> float:
        """The same, of all of the squared difference."""
        fraction = 1 - undone.total / self.total if self.total > 0 else 0.0
        return fraction if np.isfinite(fraction) else -np.inf

    @cached_property
    def sample(self) -> Pair:
        """Some thousand pixels in one row, weighted by how many each stands for.

        Taken evenly from the pixels that are the same, from those that differ, and from those that differ by more than
        the root of the mean square, so that a small part that differs much is not missed.
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
        """The part of the pair, of few pixels, that differs most: what does not hold there does not hold."""
        width, height = self.size
        columns, rows = min(width, _WINDOW), min(height, _WINDOW)
        if (columns, rows) == (width, height):
            return self
        top, left = (
            _most(self.energy.sum(axis=axis, dtype=np.float64), side) for axis, side in ((1, rows), (0, columns))
        )
        return self.part(slice(top, top + rows), slice(left, left + columns))


def _most(along: NDArray, length: int) -> int:
    """Where a run of that length begins that holds most."""
    sums = np.cumsum(np.append(0, along))
    return int((sums[length:] - sums[:-length]).argmax())


def _extremes(picture: Pixels) -> tuple[float, float]:
    return float(picture.min()), float(picture.max())
