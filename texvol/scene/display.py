"""Colours of numbers: pictures of xray, mip, minip and average, and the colour of an isosurface.

A window (centre, width) takes a number n to grey as radiological displays do (DICOM's LINEAR_EXACT): the *encoded*
grey is linear in it,

    encoded = clamp((n - centre) / width + 1/2, 0, 1)

so the linear picture holds what sRGB decodes from that, and 8 bits hold the fraction itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.air import attenuation_of
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import NUMBER_MODES, Scene
from texvol.scene.transfer import TransferFunction
from texvol.util.color import linear_from_srgb
from texvol.util.errors import InputError

ISOSURFACE_COLOR = (0.75, 0.69, 0.6)  # linear, warm; with the default light's highlight of 0.2 still below white
# Of the larger of the numbers: what a thousand float32 additions may make of one number. No contrast is made of that.
_SAME = 2.0**-16

Window = tuple[float, float]


def checked_window(window: str | Sequence[float]) -> Window:
    """Return (centre, width), data units (xray: times world units), of "CENTRE,WIDTH" or two numbers; or InputError."""
    try:
        numbers = tuple(float(number) for number in (window.split(",") if isinstance(window, str) else window))
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) != 2 or not np.isfinite(numbers).all():
        raise InputError(f"window: CENTRE,WIDTH must be two finite numbers, got {window!r}")
    if not numbers[1] > 0:
        raise InputError(f"window: width must be positive, got {numbers[1]:g}")
    return numbers[0], numbers[1]


def number_colors(scene: Scene, window: Window | None) -> TransferFunction | None:
    """The transfer function whose colours numbers have in 8 bits; None where they are grey, as in any window."""
    if window is not None or scene.coloring == "grey":
        return None
    if scene.transfer_function is None:
        from texvol.scene.transfer import proposed_for

        return proposed_for(scene.volume)
    return scene.transfer_function


def found_window(picture: NDArray, scene: Scene) -> Window:
    """(centre, width) where nobody chose one: the range of the finite values; for xray and average of the numbers.

    A value that is met somewhere is nearly an extreme of all; sums and averages may be far from that. Of a store that
    does not tell its extremes a coarse level's are known, beyond which a picture may go. The width is 0 where all are
    the same, but for rounding.
    """
    if scene.mode in ("xray", "average"):
        low, high = _range_of(picture) or (0.0, 0.0)
        if high / 2 - low / 2 <= _SAME / 2 * max(abs(low), abs(high)):
            low = high
    else:
        low, high = scene.volume.finite_range or (0.0, 0.0)
        if isinstance(scene.volume, LargeVolume) and scene.volume.levels[0].statistics is None:
            met = _range_of(picture) or (low, high)
            low, high = min(low, met[0]), max(high, met[1])
    half = high / 2 - low / 2
    return low / 2 + high / 2, 2 * min(half, float(np.finfo(np.float64).max) / 2)


def _range_of(picture: NDArray) -> tuple[float, float] | None:
    """Return the least and the largest finite number of a picture; None if it has none."""
    numbers = picture[..., 0][picture[..., 3] > 0]
    numbers = numbers[np.isfinite(numbers)]
    return (float(numbers.min()), float(numbers.max())) if numbers.size else None


def possible_range(scene: Scene) -> tuple[float, float]:
    """The least and the largest finite number that a picture of the scene may hold, of any view."""
    low, high = scene.volume.finite_range or (0.0, 1.0)
    if scene.mode != "xray":
        return low, high
    if (attenuation := attenuation_of(scene.air)) is not None:
        low, high = (attenuation.per_value * max(end - attenuation.air, 0.0) for end in (low, high))
    longest = 2 * scene.volume.radius
    return min(low * longest, 0.0), max(high * longest, 0.0)


def shown(picture: NDArray, scene: Scene, *, window: Window | None = None) -> NDArray[np.float32]:
    """A picture of numbers as a linear premultiplied one of colours, (height, width, 4), before the background.

    Pictures of other modes are colours already, and come back as they are.

    Parameters
    ----------
    picture : array of shape (height, width, 4)
        What `render` or `raycast` made of `scene`. Of coloring "tf" numbers have the straight colours of its transfer
        function, opaque, unless there is a window.
    window : (centre, width), optional
        What is black to white; see the module. Infinite numbers are black or white, what is no number is black.
        Unless it is given numbers that are grey are shown in one that is found, see `found_window`; where all numbers
        are the same they are mid-grey.
    """
    if scene.mode not in NUMBER_MODES:
        return picture.astype(np.float32)
    numbers, met = picture[..., 0].astype(np.float64), picture[..., 3] > 0
    result = np.zeros(picture.shape, np.float32)
    result[..., :3] = scene.background
    result[met, 3] = 1.0
    if (transfer := number_colors(scene, window)) is not None:
        result[met, :3] = straight_colors(transfer, numbers[met])
    else:
        result[met, :3] = grey(numbers[met], window or found_window(picture, scene))[:, np.newaxis]
    return result


def grey(numbers: NDArray[np.float64], window: Window) -> NDArray[np.float64]:
    """Return the linear grey of numbers in a window; see the module."""
    centre, width = window
    with np.errstate(over="ignore", invalid="ignore"):
        # A window without width has its middle at every finite number.
        from_centre = (numbers - centre) / width if width > 0 else np.where(np.isinf(numbers), numbers, 0 * numbers)
    return linear_from_srgb(np.clip(np.nan_to_num(from_centre + 0.5, nan=0.0), 0, 1))


def straight_colors(transfer: TransferFunction, values: ArrayLike) -> NDArray[np.float64]:
    """Colour of each value, shape (…, 3), in [0, 1], however thin a medium of that value is; black where it is NaN.

    Premultiplied: emission over extinction, black where both are 0. Emissive: the emission, over the largest of all.
    """
    numbers = transfer.at(values)
    colors, extinction = numbers[..., :3], numbers[..., 3:]
    if transfer.emissive:
        return colors / max(float(transfer.colors.max()), 1e-300)
    if transfer.premultiplied:
        thin = np.isfinite(extinction)
        straight = np.divide(colors, extinction, out=np.zeros_like(colors), where=thin & (extinction > 0))
        colors = np.where(thin, straight, colors)
    return np.minimum(colors, 1.0)


def isosurface_looks(scene: Scene) -> NDArray[np.float64]:
    """Straight colour and opacity of each of the scene's isosurfaces before light, shape (n, 4)."""
    if scene.isovalue is not None:
        return np.array([[*isosurface_color(scene, scene.isovalue), 1.0]])
    looks = [(isosurface_color(scene, each.value) if each.color is None else each.color) for each in scene.isosurfaces]
    return np.array([[*look, each.opacity] for look, each in zip(looks, scene.isosurfaces, strict=True)]).reshape(-1, 4)


def isosurface_color(scene: Scene, isovalue: float) -> NDArray[np.float64]:
    """Straight colour (3) of an isosurface before light: that of the transfer function, or ISOSURFACE_COLOR.

    The latter where there is no transfer function, or one that gives the isovalue an emission, not a colour, and
    nothing to divide it by.
    """
    transfer = scene.transfer_function
    if transfer is None or (transfer.glows and not transfer.at(isovalue)[3] > 0):
        return np.array(ISOSURFACE_COLOR)
    return straight_colors(transfer, isovalue)
