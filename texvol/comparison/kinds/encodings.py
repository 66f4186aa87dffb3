"""Encodings of light for values of any size, and conversions between straight and premultiplied colour."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texvol.util.color import linear_from_srgb

Curve = Callable[[NDArray], NDArray]

# Half a step of 8 bits: straight colour of less opacity is mostly rounding.
_LEAST_OPACITY = 1 / 510
_LARGEST_STRAIGHT = 16.0


def srgb_encoded(linear: NDArray) -> NDArray:
    """sRGB encoding (IEC 61966-2-1), continued as an odd function and above 1."""
    size = np.abs(linear)
    curved = 1.055 * size ** np.asarray(1 / 2.4, size.dtype) - 0.055
    straight_part = 12.92 * np.minimum(size, 0.0031308)
    return np.copysign(np.where(size <= 0.0031308, straight_part, curved), linear).astype(linear.dtype, copy=False)


def srgb_decoded(encoded: NDArray) -> NDArray:
    """Linear light of sRGB values, continued as an odd function and above 1."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.copysign(linear_from_srgb(np.abs(encoded)), encoded)


def to_the_power(exponent: float) -> Curve:
    """Return the odd power law x → sign(x) |x|^exponent."""

    def curve(values: NDArray) -> NDArray:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return np.copysign(np.abs(values) ** np.asarray(exponent, values.dtype), values)

    return curve


def on_premultiplied(curve: Curve, channels: slice = np.s_[:3]) -> Curve:
    """Apply a curve to the colour, or other channels, of premultiplied pixels (…, 4) without dividing by opacity."""

    def apply(pixels: NDArray) -> NDArray:
        changed = pixels.copy()
        changed[..., channels] = curve(pixels[..., channels])
        return changed

    return apply


def on_straight(curve: Curve) -> Curve:
    """Apply a curve to the straight colour of premultiplied pixels (…, 4).

    Pixels whose colour is far larger than their opacity stay: such light is emission, a background or an error, which a
    curve of c / A would hide.
    """

    def apply(pixels: NDArray) -> NDArray:
        changed = pixels.copy()
        color, opacity = straight(pixels), pixels[..., 3:]
        seen = (opacity > 0) & (np.abs(color) <= _LARGEST_STRAIGHT)
        np.copyto(changed[..., :3], curve(color) * opacity, where=seen)
        return changed

    return apply


def straight(pixels: NDArray) -> NDArray:
    """Straight colour (…, 3); 0 where opacity is 0 or too small to divide by."""
    opacity = pixels[..., 3:]
    with np.errstate(over="ignore"):
        return np.divide(pixels[..., :3], opacity, out=np.zeros_like(pixels[..., :3]), where=np.abs(opacity) > 1e-30)


def is_partial(opacity: NDArray) -> bool:
    """True if straight and premultiplied colour differ: some opacity lies strictly between 0 and 1."""
    return bool(((opacity > _LEAST_OPACITY) & (opacity < 1 - _LEAST_OPACITY)).any())
