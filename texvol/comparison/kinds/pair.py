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
    """

    candidate: Pixels
    reference: Pixels
    has_opacity: bool = True
    corner: tuple[int, int] = (0, 0)
    weights: NDArray | None = None

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

    def with_side(self, side: str, pixels: Pixels) -> Pair:
        """A pair in which one of the two is another."""
        if side == "candidate":
            return replace(self, candidate=pixels)
        return replace(self, reference=pixels)

    def explained_by(self, undone: Pair) -> float:
        """Share of the squared difference that is gone in `undone`; negative where there is more."""
        share = 1 - undone.total / self.total if self.total > 0 else 0.0
        return share if np.isfinite(share) else -np.inf

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
        row = [picture.reshape(-1, 4)[index][np.newaxis] for picture in (self.candidate, self.reference)]
        return Pair(row[0], row[1], self.has_opacity, weights=np.concatenate(weights)[np.newaxis])

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
        part = slice(top, top + rows), slice(left, left + columns)
        corner = (self.corner[0] + left, self.corner[1] + top)
        return Pair(self.candidate[part], self.reference[part], self.has_opacity, corner)


def _most(along: NDArray, length: int) -> int:
    """Where a run of that length begins that holds most."""
    sums = np.cumsum(np.append(0, along))
    return int((sums[length:] - sums[:-length]).argmax())


def _extremes(picture: Pixels) -> tuple[float, float]:
    return float(picture.min()), float(picture.max())
