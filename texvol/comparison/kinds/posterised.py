"""Posterised pictures: fewer levels than the 8 or 16 bits that store them.

Levels are j / n in the encoding or in linear light, rounded to the nearest number of the format; or the first bits of
such a number, followed by zeros or by the same bits again. Of all possible levels the fewest are chosen.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.encodings import srgb_decoded, srgb_encoded
from texvol.comparison.kinds.kind import Finding, Kind
from texvol.comparison.kinds.levels import Lattice, lattice_of
from texvol.comparison.kinds.pair import Pair, other

_STORED = {255: 8, 65535: 16}  # steps: bits
_STEPS = sorted({*range(1, 17), *(2**bits - 1 for bits in range(1, 8)), *(2**bits for bits in range(1, 8))})
# Largest probability of chance over all levels that are tried: m different numbers lie on n levels of N with
# probability (n / N)^m.
_CHANCE = 1e-5
_LEAST_OPACITY = 0.1  # straight colour of smaller opacity has few digits
_OFF = 0.02  # fraction of numbers that may be off the levels, such as a wrong pixel
_FAMILIES = 3  # most sets of levels that are returned
_LEAST = 0.95  # fraction of the squared difference that must be explained
_SLACK = 1e-3  # of a step: decoding and encoding in float32


@dataclass(frozen=True)
class Levels:
    """Numbers of a format that a posterised picture uses.

    Attributes
    ----------
    stored : Lattice
        Steps of the format.
    steps : int
        Number of levels minus one.
    how : "even", "linear", "first bits" or "repeated bits"
    """

    stored: Lattice
    steps: int
    how: str

    @property
    def numbers(self) -> NDArray:
        """Number of the format for each level, 0 to `steps`."""
        j, most = np.arange(self.steps + 1), self.stored.steps
        bits, of = int(np.log2(self.steps + 1)), _STORED[most]
        if self.how == "first bits":
            return np.asarray(j << (of - bits), float)
        if self.how == "repeated bits":
            shifts = range(of - bits, -bits, -bits)
            return np.asarray(sum(j << shift if shift >= 0 else j >> -shift for shift in shifts), float)
        fraction = j / self.steps
        return np.rint(most * (srgb_encoded(fraction) if self.how == "linear" else fraction))

    def index(self, numbers: NDArray, mode: str) -> NDArray:
        """Return the level of each number of the format."""
        most = self.stored.steps
        if self.how in ("first bits", "repeated bits"):
            at = numbers / ((most + 1) / (self.steps + 1))
        else:
            fraction = np.clip(numbers / most, 0, 1)
            at = (srgb_decoded(fraction) if self.how == "linear" else fraction) * (self.steps + (mode == "bins"))
        at = np.rint(at) if mode == "rint" else np.floor(at + _SLACK)
        return np.clip(at, 0, self.steps).astype(np.int32)

    @property
    def words(self) -> str:
        """Number of levels, their spacing, and the format that stores them."""
        bits = np.log2(self.steps + 1)
        known = f" ({bits:.0f} bits)" if bits == int(bits) else ""
        of = " of the sRGB encoding" if self.stored.is_srgb and self.how != "linear" else ", linear"
        others = {"first bits": ", the other bits 0", "repeated bits": ", the other bits the same again"}
        kept = others.get(self.how, "")
        return f"{self.steps} steps{known}{of}{', straight' * self.stored.is_straight}{kept}"


def posterised(pair: Pair) -> Finding | None:
    """Find a picture that is the other picture on fewer levels."""
    found = {side: levels_of(pair.of(side), pair.has_opacity) for side in ("candidate", "reference")}
    best: Finding | None = None
    for side, families in found.items():
        for levels in families:
            if levels in found[other(side)]:
                continue
            for mode in ("rint", "floor", "bins"):
                fraction = _explained(pair.sample, side, levels, mode)
                if fraction > _LEAST and (best is None or fraction > best.kind.explained):
                    best = _finding(pair, side, levels, mode)
    return best


def _explained(pair: Pair, side: str, levels: Levels, mode: str) -> float:
    """Fraction of the squared difference in pixels whose level is that of the other picture's number.

    That number is known to half a step of the format.
    """
    color = pair.of(other(side))
    ours, theirs = (np.clip(levels.stored.in_steps(each), 0, levels.stored.steps) for each in (pair.of(side), color))
    level = np.searchsorted(levels.numbers, np.rint(ours) - 0.5)  # first level that is not smaller
    low, high = (levels.index(theirs + by, mode) for by in (-0.5 - _SLACK, 0.5 + _SLACK))
    # Straight colour of small opacity has few digits.
    fits: NDArray = ((low <= level) & (level <= high)).all(axis=2)
    if levels.stored.is_straight:
        fits |= color[..., 3] < _LEAST_OPACITY
    return float((pair.energy * pair.pixel_weights)[fits].sum(dtype=np.float64)) * pair.largest**2 / pair.total


def levels_of(pixels: NDArray, has_opacity: bool) -> list[Levels]:
    """Return the sets of levels that hold all colours, fewest first."""
    stored = lattice_of(pixels, has_opacity)
    if stored is None or not stored.steps or stored.offset:
        return []
    finer = [steps for steps in _STORED if steps % stored.steps == 0]
    if not finer:
        return []
    stored = replace(stored, steps=finer[0])  # 15 steps are some of 255
    rows = pixels.reshape(-1, 4)
    if stored.is_straight:
        rows = rows[rows[:, 3] > _LEAST_OPACITY]
    numbers = np.unique(np.rint(stored.in_steps(rows[None])).astype(np.int64))
    inner = numbers[(numbers > 0) & (numbers < stored.steps)]
    if len(inner) < 2:
        return []
    found = []
    for levels in _families(stored):
        on = levels.numbers
        if len(inner) * np.log(len(on) / stored.steps) < np.log(_CHANCE) and np.isin(inner, on).mean() >= 1 - _OFF:
            found.append(levels)
    return found[:_FAMILIES]


def _families(stored: Lattice) -> Iterator[Levels]:
    for steps in _STEPS:
        yield Levels(stored, steps, "even")
        if stored.is_srgb:
            yield Levels(stored, steps, "linear")
        if steps & (steps + 1) == 0:
            yield Levels(stored, steps, "first bits")
            yield Levels(stored, steps, "repeated bits")


def _finding(pair: Pair, side: str, levels: Levels, mode: str) -> Finding:
    down = {"floor": ", downwards", "bins": ", in bins of one size"}.get(mode, "")
    bits = _STORED[levels.stored.steps]
    words = f"the {side} is quantised to {levels.words}{down}, and stored in {bits} bits"
    said = {
        "quantised": side,
        "steps": levels.steps,
        "levels": levels.steps + 1,
        "stored_steps": levels.stored.steps,
        "encoding": "sRGB" if levels.stored.is_srgb and levels.how != "linear" else "linear",
        "color": "straight" if levels.stored.is_straight else "premultiplied",
        "how": levels.how,
        "rounding": {"rint": "nearest", "floor": "down", "bins": "bins"}[mode],
    }
    kind = Kind("banding", _explained(pair, side, levels, mode), words, said)
    return Finding(kind, pair.with_side("candidate", pair.reference))
