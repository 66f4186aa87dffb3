"""Exchanged order: opacity is the same, and colour is as if front and back had been exchanged.

For two layers with opacities a, b and straight colours s, t the orders differ by

    (a s + (1 - a) b t) - (b t + (1 - b) a s) = a b (s - t)

while opacity a + b - a b is symmetric. However a pixel of opacity A is divided in two layers, a b is at most
(1 - √(1 - A))², about A² / 4 for small A; a change of colour is proportional to A. So thin pixels distinguish them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.encodings import is_partial
from texvol.comparison.kinds.kind import Finding, Kind, number
from texvol.comparison.kinds.pair import Pair

_OPACITY_FRACTION = 0.02  # largest fraction of the squared difference in opacity, from rounding and thin slabs
_BINS = 12
_LEAST_PIXELS = 20  # of a bin
# Halfway between a change proportional to opacity and one proportional to its square.
_LEAST_POWER = 1.5
_STEPS = 8.0  # half steps of opacity
_OF_ROUNDING = 2.0  # times the squares that rounding makes: least sum of squares of a usable bin


def swapped(pair: Pair) -> Finding | None:
    """Find an exchange of front and back."""
    opacity = pair.reference[..., 3]
    if not pair.has_opacity or not is_partial(opacity):
        return None
    difference = pair.difference
    of_opacity = float(np.square(difference[..., 3], dtype=np.float64).sum())
    if of_opacity > _OPACITY_FRACTION * pair.total:
        return None
    power = _power(pair)
    if power is None or power < _LEAST_POWER:
        return None
    # Two orders differ by at most a b times the largest difference of straight colours.
    most = np.square(1 - np.sqrt(1 - np.clip(opacity, 0, 1)))
    brightest = max(1.0, pair.scale)
    rounded = 0 if pair.allowance is None else pair.allowance[..., :3].max(axis=2)
    beyond = np.abs(difference[..., :3]).max(axis=2) > most * brightest + 0.01 * pair.largest + rounded
    explained = (
        1 - float(pair.energy[beyond].sum(dtype=np.float64)) * pair.largest**2 / pair.total - of_opacity / pair.total
    )
    words = (
        "opacity is the same, and colour differs only where the medium is thick, as if front and back were exchanged "
        f"(the difference grows with opacity to the power {number(power, 2)})"
    )
    left = pair.with_side("reference", pair.candidate)
    return Finding(Kind("swapped order", explained, words, {"power": power}), left)


def _power(pair: Pair) -> float | None:
    """Return the exponent p of rms difference ∝ A^p over the thin pixels; None if they are too few."""
    depth = pair.reference[..., 3].ravel()
    # An opacity rounded to 0 has no colour, and one of a few steps an inexact colour.
    least = 0.0 if pair.roundings is None else _STEPS * max(float(each[..., 3].max()) for each in pair.roundings)
    thin = (depth > max(least, 1e-3)) & (depth < 0.5)
    if thin.sum() < 2 * _LEAST_PIXELS:
        return None
    # x = 1 - √(1 - A), about A / 2, whose square bounds the difference however opaque.
    x = 1 - np.sqrt(1 - depth[thin].astype(np.float64))
    squares = np.square(pair.difference[..., :3], dtype=np.float64).sum(axis=2).ravel()[thin]
    rounding = _rounding(pair).ravel()[thin]
    edges = np.geomspace(x.min(), x.max() * (1 + 1e-9), _BINS + 1)
    index = np.digitize(x, edges[1:-1])
    counts = np.bincount(index, minlength=_BINS)
    sums, floors = np.bincount(index, squares, _BINS), np.bincount(index, rounding, _BINS)
    used = (counts >= _LEAST_PIXELS) & (sums > _OF_ROUNDING * floors)
    if used.sum() < 3 or np.log(edges[-1] / edges[0]) < np.log(2):
        return None
    rms = np.sqrt((sums - floors)[used] / counts[used])
    at = np.log(np.bincount(index, x, _BINS)[used] / counts[used])
    return float(np.polyfit(at, np.log(rms), 1)[0])


def _rounding(pair: Pair) -> NDArray:
    """Mean squared difference of colour that rounding makes in each pixel."""
    if pair.roundings is None:
        return np.zeros(pair.energy.shape)
    return np.asarray(sum(np.square(each[..., :3], dtype=np.float64).sum(axis=2) for each in pair.roundings) / 3)
