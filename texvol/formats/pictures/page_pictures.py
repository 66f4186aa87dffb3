"""Pictures in HTML pages: PNG files, data URLs, and false colours."""

from __future__ import annotations

import base64
from functools import cache

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures import image
from texvol.util import color

# Perceptually uniform, from dark to bright, and safe for colour-blind readers.
_COLORMAP = "inferno"


def png(picture: NDArray) -> bytes:
    """Return the PNG file of a linear premultiplied picture over black."""
    return image.encoded("picture.png", picture)


def data_url(content: bytes, kind: str = "image/png") -> str:
    """Return the content as a data URL."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


@cache
def color_table() -> NDArray[np.uint8]:
    """Return the 256 colours of the false-colour map, 8-bit sRGB, (256, 3)."""
    from cmap import Colormap

    return np.rint(255 * np.asarray(Colormap(_COLORMAP)(np.arange(256) / 255), np.float64)[:, :3]).astype(np.uint8)


def colored(fractions: NDArray) -> NDArray[np.float64]:
    """Return a linear picture in false colours of fractions in [0, 1]."""
    from cmap import Colormap

    colors = np.asarray(Colormap(_COLORMAP)(fractions), np.float64)
    colors[..., :3] = color.linear_from_srgb(colors[..., :3])
    return colors
