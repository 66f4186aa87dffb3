"""Drawing: the picture of a translation, its error, and its file.

Each layer is drawn by itself, to the same error, and blended over those below it by napari's rules, in sRGB, as
napari's canvas does that.
"""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol import Picture, Renderer
from texvol.formats.pictures import image
from texvol.util.color import linear_from_srgb
from texvol.util.upward import upward
from texvol_napari.translation import Part, Translation

_LEVELS = 255.0

Colors = NDArray[np.float64]


@dataclass(frozen=True)
class Drawing:
    """Picture of the layers.

    Attributes
    ----------
    pixels : array of shape (height, width, 3)
        sRGB, 8 bits.
    lines : tuple of str
        The error of each layer, and what differs from napari's picture.
    picture : Picture, optional
        Of the only layer, if the drawing is its picture: its file says how it was made.
    """

    pixels: NDArray[np.uint8]
    lines: tuple[str, ...]
    picture: Picture | None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a PNG or JPEG; InputError if it can't be written."""
        if self.picture is not None:
            self.picture.save(path)
            return
        opaque = np.ones((*self.pixels.shape[:2], 1))
        image.write(path, np.dstack([linear_from_srgb(self.pixels / _LEVELS), opaque]).astype(np.float32))


def drawn(translation: Translation, size: tuple[int, int], levels: float = 1.0, backend: str = "auto") -> Drawing:
    """Return the picture.

    Parameters
    ----------
    size : (width, height)
        Pixels.
    levels : float
        Largest error of each layer, in 255ths: of linear light, or of the contrast limits in mip, minip and average.
    """
    lines = []
    canvas: Colors = np.zeros((size[1], size[0], 3))
    with Renderer(backend) as renderer, warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the error that was reached is told for each layer
        for number, part in enumerate(translation.parts):
            asked = levels / _LEVELS * (part.value_range or 1.0)
            picture = renderer.render(part.scene, size, max_error=asked)
            lines.append(_error_line(part, picture, asked))
            canvas = blended(canvas, *_straight(part, picture), part.blending, is_lowest=number == 0)
    alone = len(translation.parts) == 1 and _is_whole(translation.parts[0])
    pixels = picture.to_srgb() if alone else np.rint(np.clip(canvas, 0, 1) * _LEVELS).astype(np.uint8)
    return Drawing(pixels, (*lines, *translation.remarks), picture if alone else None)


def blended(below: Colors, colors: Colors, opacity: Colors, blending: str, *, is_lowest: bool = False) -> Colors:
    """Return colours (height, width, 3) over those below by a blending of napari; the lowest layer is over black."""
    alpha = opacity[..., np.newaxis]
    covers = alpha > 0
    if is_lowest:
        return np.where(covers, colors, below) if blending == "minimum" else colors * alpha
    if blending == "additive":
        return np.minimum(below + colors * alpha, 1.0)
    if blending == "minimum":
        return np.where(covers, np.minimum(below, colors), below)
    if blending == "multiplicative":
        return np.where(covers, below * colors, below)
    if blending == "opaque":
        return np.where(covers, colors, below)
    return colors * alpha + below * (1 - alpha)


def _is_whole(part: Part) -> bool:
    return part.opacity == 1 and part.blending != "minimum" and not np.isfinite(part.shown).any()


def _straight(part: Part, picture: Picture) -> tuple[Colors, Colors]:
    """Return straight colours in sRGB from 0 to 1, and the opacity."""
    straight = picture.to_srgb(transparent=True) / _LEVELS
    opacity = straight[..., 3] * part.opacity
    if part.value_range:
        numbers = np.asarray(picture)[..., 0]
        opacity = np.where((numbers > part.shown[0]) & (numbers < part.shown[1]), opacity, 0.0)
    return straight[..., :3], opacity


def _error_line(part: Part, picture: Picture, asked: float) -> str:
    error = picture.error
    if error is None:
        return f"{part.name}: error unknown"
    scale = part.value_range or 1.0
    unit = "of the contrast limits" if part.value_range else "of linear light"
    missed = "" if error <= asked else f"; asked for {asked / scale:.2g}, which was not reached"
    return f"{part.name}: estimated error {upward(error / scale)} {unit}{missed}"
