"""Opacity: of another slab thickness, multiplied into colour or not, or in front of another background.

scaled opacity      A' = 1 - (1 - A)^k with the same straight colour: path lengths k times as long
straight colour     C' = C / A, or C · A
background          C' = C + (1 - A) b; over an opaque background A' = 1
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds.encodings import Curve, is_partial, straight
from texvol.comparison.kinds.fitting import least
from texvol.comparison.kinds.kind import Change, number
from texvol.comparison.kinds.pair import ROUNDING, Pair, other

_LEAST_RATIO, _LARGEST_RATIO = 1 / 64, 64.0
_ONE_RATIO = 1e-4  # least distance of a ratio of thicknesses from 1
_TINY, _CLEAR = 1e-30, 1e-3  # opacities
_FRACTION_OF_OPACITY, _PROVEN = 0.02, 0.98  # of the squared difference


def changes(sample: Pair) -> Iterator[Change]:
    """Yield the changes of opacity, or of colour by opacity, that may explain a sample's difference."""
    if not sample.has_opacity:
        return
    opacities = {side: sample.of(side)[..., 3] for side in ("candidate", "reference")}
    if is_partial(opacities["candidate"]) or is_partial(opacities["reference"]):
        yield from _straight()
        yield from _scaled(sample)
    yield from _background(sample)
    for side, opacity in opacities.items():
        if opacity.min() >= 1 - ROUNDING and opacities[other(side)].min() < 1 - ROUNDING:
            yield from _flattened(sample, side)


def rescaled(ratio: float, light: NDArray) -> Curve:
    """Return the curve of a medium that is `ratio` times as thick, with the same straight colour.

    `light` is the light of a background, which enters as (1 - opacity) · light and is no part of the medium.
    """

    def apply(pixels: NDArray) -> NDArray:
        behind = light.astype(pixels.dtype)
        opacity = np.clip(pixels[..., 3:], 0, 1)
        with np.errstate(divide="ignore", over="ignore"):
            # log1p and expm1 keep the digits of a small opacity.
            scaled = -np.expm1(np.asarray(ratio, pixels.dtype) * np.log1p(-opacity))
            # Subnormal opacities have no usable ratio.
            fraction = np.divide(scaled, opacity, out=np.full_like(scaled, ratio), where=opacity > _TINY)
        color = (pixels[..., :3] - (1 - opacity) * behind) * fraction + (1 - scaled) * behind
        return np.concatenate([color, scaled], axis=-1)

    return apply


def proves(sample: Pair, change: Change) -> bool:
    """True if opacity alone proves a scaled opacity; colour follows it only in a medium of one colour."""
    weights = sample.pixel_weights
    changed = change.apply(sample.reference)[..., 3], change.apply(sample.candidate)[..., 3]
    pairs = (sample.reference[..., 3], sample.candidate[..., 3]), (changed[0], sample.candidate[..., 3]), changed
    before, after, both = (float((weights * np.square(a - b, dtype=np.float64)).sum()) for a, b in pairs)
    return before > _FRACTION_OF_OPACITY * sample.total and after < (1 - _PROVEN) * min(before, both)


def _scaled(sample: Pair) -> Iterator[Change]:
    weights = sample.pixel_weights
    wanted = sample.candidate[..., 3].astype(np.float64)
    depth = np.log1p(-np.clip(sample.reference[..., 3].astype(np.float64), 0, 1 - 1e-12))

    def cost(ratio: float) -> float:
        return float((weights * np.square(wanted + np.expm1(ratio * depth))).sum())

    ratio = least(cost, _LEAST_RATIO, _LARGEST_RATIO)
    if abs(np.log(ratio)) < _ONE_RATIO:
        return
    words = f"the candidate's opacity is that of a medium, or of slabs, {number(ratio, 4)} times as thick"
    clear = sample.reference[sample.reference[..., 3] < _CLEAR]
    light = clear[:, :3].astype(np.float64).mean(axis=0) if len(clear) else np.zeros(3)
    for behind in (np.zeros(3), light) if light.max() > ROUNDING * sample.scale else (np.zeros(3),):
        yield Change("scaled opacity", "reference", rescaled(ratio, behind), words, {"ratio": ratio}, fitted=1)


def _straight() -> Iterator[Change]:
    def times_opacity(pixels: NDArray) -> NDArray:
        return np.concatenate([pixels[..., :3] * pixels[..., 3:], pixels[..., 3:]], axis=-1)

    def by_opacity(pixels: NDArray) -> NDArray:
        return np.concatenate([straight(pixels), pixels[..., 3:]], axis=-1)

    for side in ("candidate", "reference"):
        again = f"or the {other(side)}'s colour was multiplied by opacity once too often"
        words = f"the {side}'s colour is straight, and the {other(side)}'s premultiplied ({again})"
        # Multiplication leaves out pixels too thin to have a colour; division also leaves out a background, as
        # straight colour is 0 where there is no opacity.
        yield Change("straight colour", side, times_opacity, words, {"straight": side})
        yield Change("straight colour", other(side), by_opacity, words, {"straight": side})


def _background(sample: Pair) -> Iterator[Change]:
    """Other light of the background."""
    light = _light_behind(sample, "reference", sample.difference)
    if light is None:
        return
    words = f"the candidate's background is brighter, by {_triple(light)}"
    if (light <= 0).all():
        words = f"the candidate's background is darker, by {_triple(-light)}"
    yield Change("background", "reference", _over(light), words, {"light": light.tolist()}, fitted=3)


def _flattened(sample: Pair, opaque: str) -> Iterator[Change]:
    """One picture is already composited over an opaque background."""
    clear = other(opaque)
    light = _light_behind(sample, clear, sample.of(opaque).astype(np.float64) - sample.of(clear))
    if light is None:
        return
    light[np.abs(light) <= ROUNDING * sample.scale] = 0
    words = f"the {opaque} is opaque everywhere, over a background of {_triple(light)}, and the {clear} is not"
    parameters = {"light": light.tolist(), "opaque": opaque}
    curve = _over(light, is_opaque=True)
    yield Change("background", clear, curve, words, parameters, fitted=3, is_idempotent=True)


def _light_behind(sample: Pair, side: str, missing: NDArray) -> NDArray | None:
    """Fit the light that enters one picture as (1 - opacity) · light to its missing colour; None if all is opaque."""
    clear = 1 - sample.of(side)[..., 3].astype(np.float64)
    weights = clear * sample.pixel_weights
    squares = (weights * clear).sum()
    return (weights[..., np.newaxis] * missing[..., :3]).sum(axis=(0, 1)) / squares if squares > 0 else None


def _over(light: NDArray, *, is_opaque: bool = False) -> Curve:
    """Return the curve that puts light behind pixels, which leaves their opacity unless the light is opaque."""

    def apply(pixels: NDArray) -> NDArray:
        changed = pixels.copy()
        changed[..., :3] += (1 - pixels[..., 3:]) * light.astype(pixels.dtype)
        if is_opaque:
            changed[..., 3] = 1
        return changed

    return apply


def _triple(light: NDArray) -> str:
    return f"({', '.join(number(float(each)) for each in light)})"
