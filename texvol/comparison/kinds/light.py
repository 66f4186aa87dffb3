"""Light: a common factor or summand, exchanged channels, cut values."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.encodings import Curve, on_premultiplied
from texvol.comparison.kinds.kind import Change, number
from texvol.comparison.kinds.pair import ROUNDING, SIDES, Pair, other

_LEAST_FACTOR, _SCATTER = 0.002, 6.0  # least distance of a factor from 1: absolute, and in standard deviations of noise
_LETTERS = "RGBA"


def changes(pair: Pair) -> Iterator[Change]:
    """Yield the changes of light that may explain a pair's difference."""
    yield from _factors(pair.sample)
    yield from _summands(pair.sample)
    yield from _permutations(pair.sample)
    yield from _cuts(pair)


def _factors(sample: Pair) -> Iterator[Change]:
    weights = sample.pixel_weights[..., np.newaxis]
    parts = {"colour": slice(0, 3)}
    if sample.has_opacity:
        parts |= {"opacity": slice(3, 4), "all four channels": slice(0, 4)}
    for part, channels in parts.items():
        factor = _ratio(sample.candidate[..., channels], sample.reference[..., channels], weights)
        verb = "are" if part == "all four channels" else "is"
        words = f"the candidate's {part} {verb} {number(factor, 4)} times the reference's"
        name = "scaled opacity" if part == "opacity" else "brightness"
        if part == "opacity":
            words += ", and colour is the same"
        parameters = {"factor": factor, "part": part}
        yield Change(name, "reference", _times(factor, channels), words, parameters, fitted=1)
    if sample.has_opacity:
        yield from _opacity_with_color(sample)
    each = [_ratio(sample.candidate[..., [i]], sample.reference[..., [i]], weights) for i in range(3)]
    shown = ", ".join(number(one, 4) for one in each)
    words = f"the candidate's red, green and blue are ({shown}) times the reference's"
    yield Change("brightness", "reference", _times(each), words, {"factors": each}, fitted=3)


def dimmed(pair: Pair) -> Change | None:
    """Return the factor of colour between two noisy pictures; None if noise alone may have caused it.

    Noise in the reference makes <c, r> / <r, r> smaller; noise in the candidate makes <c, c> / <c, r> larger. The
    factor is the one of the two that is nearer to 1.
    """
    candidate, reference = (pair.of(side)[..., :3].ravel() for side in SIDES)
    scale = np.float32(1 / max(pair.scale, 1e-30))
    candidate, reference = candidate * scale, reference * scale
    of_c, of_r = float(np.vdot(candidate, candidate)), float(np.vdot(reference, reference))
    products = float(np.vdot(candidate, reference))
    if not (products > 0 and of_r > 0):
        return None
    factor = min(products / of_r, of_c / products, key=lambda each: abs(each - 1))
    scatter = np.sqrt(max(of_c + of_r - 2 * products, 0) / of_r / candidate.size)
    agree = (products / of_r - 1) * (of_c / products - 1) > 0
    if not agree or abs(factor - 1) < max(_LEAST_FACTOR, _SCATTER * scatter):
        return None
    words = f"the candidate's colour is {number(factor, 4)} times the reference's"
    said = {"factor": factor, "part": "colour"}
    return Change("brightness", "reference", _times(factor), words, said, fitted=1)


def _opacity_with_color(sample: Pair) -> Iterator[Change]:
    """Opacity times a factor, cut at 1, with the same straight colour."""
    opacity = sample.candidate[..., 3:], sample.reference[..., 3:]
    thin = sample.pixel_weights[..., np.newaxis] * (np.maximum(*opacity) < 1 - ROUNDING)
    factor = _ratio(*opacity, thin)
    # Undoing scales the smaller opacity up; the larger opacity may have been cut.
    side, by = ("reference", factor) if factor >= 1 else ("candidate", 1 / max(factor, 1e-6))

    def apply(pixels: NDArray) -> NDArray:
        more = np.minimum(pixels[..., 3:] * np.asarray(by, pixels.dtype), np.maximum(pixels[..., 3:], 1))
        fraction = np.divide(more, pixels[..., 3:], out=np.ones_like(more), where=pixels[..., 3:] > 0)
        return pixels * fraction

    words = f"the candidate's opacity is {number(factor, 4)} times the reference's, under the same straight colour"
    if abs(factor - 1) > ROUNDING and float(sample.of(side)[..., 3].max()) * by > 1 >= float(np.max(opacity)):
        words += ", cut at 1"
        yield Change("scaled opacity", side, apply, words, {"factor": factor, "part": "opacity, straight"}, fitted=1)


def _summands(sample: Pair) -> Iterator[Change]:
    weights = sample.pixel_weights[..., np.newaxis]
    each = (weights * sample.difference[..., :3]).sum(axis=(0, 1)) / weights.sum()
    for summand, fitted in ((np.full(3, each.mean()), 1), (each, 3)):
        shown = number(summand[0]) if fitted == 1 else f"({', '.join(number(float(one)) for one in summand)})"
        words = f"the candidate's colour is the reference's plus {shown} everywhere"
        yield Change("brightness", "reference", _plus(summand), words, {"summand": summand.tolist()}, fitted=fitted)


def _permutations(sample: Pair) -> Iterator[Change]:
    """Permutation of channels that fits best.

    Σ (c_i - r_π(i))² is a sum of products of channels, so one pass over the pixels is enough for all permutations.
    """
    count = sample.channels
    candidate, reference = (sample.of(side)[..., :count].reshape(-1, count).astype(np.float64) for side in SIDES)
    products = (candidate * sample.pixel_weights[..., np.newaxis].reshape(-1, 1)).T @ reference
    rows = list(range(count))
    best = max(permutations(rows), key=lambda order: float(products[rows, order].sum()))
    if best != tuple(rows):
        order = [*best, *range(count, 4)]
        shown = "".join(_LETTERS[i] for i in best)
        if count == 4 and best[3] == 3:
            shown = shown[:3]
        words = f"the candidate's {_LETTERS[: len(shown)]} are the reference's {shown}"
        yield Change("channels swapped", "reference", lambda pixels: pixels[..., order], words, {"order": shown})


def _cuts(pair: Pair) -> Iterator[Change]:
    """One picture is cut at a value, and the other goes on."""
    for cut in SIDES:
        low, high = _ends(pair, cut)
        uncut = pair.of(other(cut))
        margin = ROUNDING * pair.scale
        above, below = float(uncut.max()) > high + margin, float(uncut.min()) < low - margin
        if not (above or below):
            continue
        ends = [f"over {number(high)}"] * above + [f"under {number(low)}"] * below
        words = f"values {' and '.join(ends)} are cut off in the {cut}"
        parameters = {"cut": cut, "low": low if below else None, "high": high if above else None}
        yield Change("clipped", other(cut), _clip(low, high), words, parameters, is_idempotent=True)


def _ends(pair: Pair, side: str) -> tuple[float, float]:
    """Values at which a picture may have been cut: 0 and 1, or its extreme values if many pixels have them."""
    pixels = pair.of(side)
    largest = float(pixels[..., :3].max())
    low = 0.0 if pixels.min() >= 0 else -np.inf
    if abs(largest - 1) <= ROUNDING:
        return low, 1.0
    # A cut leaves many pixels at one value; the other picture has brighter pixels there.
    at_top = (pixels[..., :3] == largest) & (pair.of(other(side))[..., :3] > largest)
    many = at_top.any(axis=2).sum() >= max(4, at_top.shape[0] * at_top.shape[1] // 10_000)
    flat = largest == float(pixels[..., :3].min())
    return low, largest if many and not flat else np.inf


def _ratio(of: NDArray, to: NDArray, weights: NDArray) -> float:
    """Return the factor k that minimises the weighted |of - k·to|²; 1 where `to` is 0 everywhere."""
    of, to = of.astype(np.float64), to.astype(np.float64)
    below = float((weights * to * to).sum())
    return float((weights * of * to).sum()) / below if below > 0 else 1.0


def _times(factor: float | list[float], channels: slice = np.s_[:3]) -> Curve:
    return on_premultiplied(lambda values: values * np.asarray(factor, values.dtype), channels)


def _plus(summand: NDArray) -> Curve:
    return on_premultiplied(lambda color: color + summand.astype(color.dtype))


def _clip(low: float, high: float) -> Curve:
    def apply(pixels: NDArray) -> NDArray:
        changed = np.clip(pixels, low, high)
        changed[..., 3] = pixels[..., 3] if not np.isfinite(high) else np.clip(pixels[..., 3], 0, 1)
        return changed

    return apply
