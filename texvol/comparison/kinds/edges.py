"""Differences at edges of the picture's content: unlike outlines, and blur."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.kind import Finding, Kind, number
from texvol.comparison.kinds.pair import GREY, Pair, Pixels
from texvol.comparison.measures import extreme_around

# Nine tenths of the difference, on the steepest half of the pixels with content, and a quarter of the picture.
_FRACTION, _OF_SHOWN, _AREA = 0.9, 1 / 2, 0.25
_SHOWN = 0.005  # of the largest contrast; less contrast is background
_SPREAD = 0.01  # of the pixels on edges
_BINS = 256
_LEAST_IN_WINDOW = 0.5  # fraction that must be explained in the part that differs most


def edges(pair: Pair) -> Finding | None:
    """Find a difference that lies at edges of the content only."""
    if min(pair.size) < 8:
        return None
    # The smaller contrast of the two: an error in one picture makes an edge in that picture only.
    contrast = np.minimum(_contrast(pair.candidate), _contrast(pair.reference))
    if not contrast.max() > 0:
        return None
    steps = np.minimum(contrast * np.float32(_BINS / max(float(contrast.max()), 1e-30)), _BINS - 1).astype(np.int32)
    counts = np.bincount(steps.ravel(), minlength=_BINS)[::-1]
    energies = np.bincount(steps.ravel(), pair.energy.ravel(), _BINS)[::-1]
    # Pixels by falling contrast, until they hold nine tenths of the difference.
    reached = int(np.searchsorted(np.cumsum(energies), _FRACTION * energies.sum()))
    area = float(counts[: reached + 1].sum() / contrast.size)
    fraction = float(energies[: reached + 1].sum() / energies.sum())
    # A spot on an edge is no difference of edges: so the effective number of differing pixels must be large.
    spread = float(energies.sum()) ** 2 / max(float(np.square(pair.energy, dtype=np.float64).sum()), 1e-300)
    if spread < _SPREAD * counts[: reached + 1].sum():
        return None
    shown = _shown(pair.reference @ GREY, contrast)
    if area > min(_AREA, _OF_SHOWN * shown):
        return None
    words = (
        f"the difference lies on edges and outlines: {number(100 * fraction, 3)} % of "
        f"it on {number(100 * area, 2)} % of the pixels"
    )
    parameters = {"share": fraction, "area": area}
    return Finding(Kind("edges only", fraction, words, parameters), pair.with_side("candidate", pair.reference))


def _shown(grey: Pixels, contrast: Pixels) -> float:
    """Return the fraction of pixels with content: pixels of a gradient, or of another grey than the background."""
    low, high = float(grey.min()), float(grey.max())
    steps = ((grey - low) * np.float32((_BINS - 1) / max(high - low, 1e-30))).astype(np.int32)
    counts = np.bincount(steps.ravel(), minlength=_BINS)
    usual = int(counts.argmax())
    is_background = steps == usual if counts[usual] > _AREA * steps.size else np.zeros(steps.shape, bool)
    return float((~is_background | (contrast > _SHOWN * contrast.max())).mean())


def blur(pair: Pair) -> Finding | None:
    """Find a blurred or sharpened candidate: r + s ∇²r of the reference r."""
    if pair.window is not pair:
        seen = blur(pair.window)
        if seen is None or seen.kind.explained < _LEAST_IN_WINDOW:
            return None
    if min(pair.size) < 8:
        return None
    before = pair.part(slice(1, pair.size[1] - 1), slice(1, pair.size[0] - 1))
    best: Finding | None = None
    for blurred, sharp in (("candidate", "reference"), ("reference", "candidate")):
        detail = _laplacian(pair.of(sharp))
        below = float(np.vdot(detail, detail))
        amount = float(np.vdot(detail, before.of(blurred) - before.of(sharp))) / below if below > 0 else 0.0
        if not 0 < amount < 1:
            continue
        left = before.with_side(sharp, before.of(sharp) + np.float32(amount) * detail)
        explained = before.explained_by(left)
        words = f"the {blurred} is blurred, by about {number(np.sqrt(2 * amount), 2)} pixels, against the {sharp}"
        if best is None or explained > best.kind.explained:
            kind = Kind("blurred", explained, words, {"blurred": blurred, "sigma": float(np.sqrt(2 * amount))})
            best = Finding(kind, left)
    return best


def _contrast(picture: Pixels) -> NDArray:
    """Largest minus smallest grey of each pixel and its eight neighbours."""
    grey = picture @ GREY
    return extreme_around(np.maximum, grey) - extreme_around(np.minimum, grey)


def _laplacian(picture: Pixels) -> Pixels:
    inner = picture[1:-1, 1:-1]
    return picture[2:, 1:-1] + picture[:-2, 1:-1] + picture[1:-1, 2:] + picture[1:-1, :-2] - 4 * inner
