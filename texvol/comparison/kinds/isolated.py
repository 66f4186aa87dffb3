"""Isolated pixels: a few pixels that differ far more than their neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.kind import CHANNELS, Finding, Kind
from texvol.comparison.kinds.pair import Pair

_MOST = 16  # more pixels are noise
_STANDS_OUT = 5.0  # times the neighbours' difference
_NAMED = 5  # pixels that the sentence lists
_SURELY = 3.0  # times the allowance of rounding; of thousands of pixels a few are just above it
_FEWEST_PIXELS = 6  # a smaller picture has no isolated pixel


def isolated(pair: Pair, seen: Pair | None = None) -> Finding | None:
    """Find the few pixels that differ far more than their neighbours in the pair, or in the pair `seen` of its size."""
    pixels = _pixels(seen or pair)
    if pixels is None:
        return None
    differences = pair.difference[pixels]
    order = np.argsort(-np.abs(differences).max(axis=1), kind="stable")
    found = []
    for i in order:
        by = [float(each) for each in differences[i, : pair.channels]]
        channel = int(np.abs(by).argmax())
        at = (int(pixels[1][i]) + pair.corner[0], int(pixels[0][i]) + pair.corner[1])
        found.append({"column": at[0], "row": at[1], "channel": CHANNELS[channel], "by": by[channel], "all": by})
    named = "; ".join(f"column {p['column']}, row {p['row']}: {p['channel']} {p['by']:+.3g}" for p in found[:_NAMED])
    count = "one pixel is" if len(found) == 1 else f"{len(found)} single pixels are"
    words = f"{count} off: {named}{' …' * (len(found) > _NAMED)}"
    explained, parameters = _explained(pair, pixels), {"count": len(found), "pixels": found}
    return Finding(Kind("isolated pixels", explained, words, parameters), _without(pair, pixels))


def _pixels(pair: Pair) -> tuple[NDArray, NDArray] | None:
    """Return the rows and columns of the pixels that differ far more than their neighbours; None if there are none."""
    energy = pair.energy
    if energy.size < _FEWEST_PIXELS:
        return None
    # Only pixels that differ by more than most are candidates: few.
    # (Half of the largest: among six pixels one can't be 25 times their mean.)
    usual = min(_STANDS_OUT**2 * float(energy.mean(dtype=np.float64)), 0.5 * float(energy.max()))
    rows, columns = np.nonzero(energy > max(usual, 1e-8))
    if not 0 < len(rows) <= energy.size // 50 + _MOST:
        return None
    around = _largest_around(energy, rows, columns)
    alone = energy[rows, columns] > _STANDS_OUT**2 * around
    return (rows[alone], columns[alone]) if 0 < alone.sum() <= min(_MOST, energy.size // 4) else None


def _without(pair: Pair, pixels: tuple[NDArray, NDArray]) -> Pair:
    """Return the pair with these pixels made equal."""
    candidate = pair.candidate.copy()
    candidate[pixels] = pair.reference[pixels]
    return pair.with_side("candidate", candidate)


def _explained(pair: Pair, pixels: tuple[NDArray, NDArray]) -> float:
    """Return the fraction of the difference beyond rounding in these pixels.

    If the pixels are hardly beyond their own rounding, the fraction is of all that rounding does not explain.
    """
    beyond = pair.beyond.all_explained_by(_without(pair.beyond, pixels))
    if pair.allowance is None:
        return beyond
    differences = np.abs(pair.difference[pixels])
    times = (differences / np.maximum(pair.allowance[pixels], 1e-9)).max(axis=1)
    if times.min() >= _SURELY:
        return beyond
    return min(beyond, float(np.square(differences, dtype=np.float64).sum()) / max(pair.signal, 1e-300))


def _largest_around(energy: NDArray, rows: NDArray, columns: NDArray) -> NDArray:
    """Return the largest energy among the eight neighbours of each pixel."""
    height, width = energy.shape
    largest = np.zeros(len(rows), energy.dtype)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            if down or right:
                y, x = rows + down, columns + right
                inside = (y >= 0) & (y < height) & (x >= 0) & (x < width)
                found = energy[np.where(inside, y, 0), np.where(inside, x, 0)]
                largest = np.maximum(largest, np.where(inside, found, 0))
    return largest
