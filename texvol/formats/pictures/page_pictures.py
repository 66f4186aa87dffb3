"""Pictures inside pages: PNG and JPEG bytes, data: URLs, and the colours of false-colour maps."""

from __future__ import annotations

import base64
from functools import cache

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures import image
from texvol.util import color

# Perceptually even, dark to bright, and told apart by all kinds of eyes.
_COLORMAP = "inferno"


def png(picture: NDArray) -> bytes:
    """PNG file of a picture, linear and premultiplied, over black."""
    return image.encoded("picture.png", picture)


def data_url(content: bytes, kind: str = "image/png") -> str:
    """The content as a URL that needs no network."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


@cache
def color_table() -> NDArray[np.uint8]:
    """The 256 colours of a false-colour map, least to largest: sRGB of 8 bits, (256, 3)."""
    from cmap import Colormap

    return np.rint(255 * np.asarray(Colormap(_COLORMAP)(np.arange(256) / 255), np.float64)[:, :3]).astype(np.uint8)


def colored(fractions: NDArray) -> NDArray[np.float64]:
    """A linear picture in the false colours of shares in [0, 1]."""
    from cmap import Colormap

    colors = np.asarray(Colormap(_COLORMAP)(fractions), np.float64)
    colors[..., :3] = color.linear_from_srgb(colors[..., :3])
    return colors
