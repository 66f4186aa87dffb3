"""Views of a page, compressed so that they fit its room.

Every view is encoded as WebP of good quality when it is drawn, which takes a tenth of its memory. If all of them are
too large together, they are encoded again, from that, with the highest quality that fits, and below a quality of 30
with fewer pixels.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures import image
from texvol.util import writing
from texvol.util.errors import InputError

KIND = "image/webp"
_FIRST = 90  # quality
_QUALITIES = (80, 70, 60, 50, 40, 30)
_SCALES = (1.0, 0.75, 0.5, 0.35, 0.25)
_SAMPLE = 12  # views that a quality is tried on
_RESERVE = 1.05  # of the room that the sample asks for


@dataclass(frozen=True)
class Fitted:
    """Encoded views in the room of a page.

    Attributes
    ----------
    files : list of bytes
    quality : int
        Of WebP, 0 to 100.
    scale : float
        Pixels of their sides, as a fraction of those that were drawn.
    """

    files: list[bytes]
    quality: int
    scale: float

    @property
    def is_reduced(self) -> bool:
        """True if the views had to lose quality or pixels."""
        return self.quality < _FIRST or self.scale < 1


def first_encoded(picture: NDArray[np.float32]) -> bytes:
    """Return the file of a linear premultiplied picture, shape (height, width, 4), over its background."""
    return _encoded(image.eight_bits(picture), _FIRST)


def fitted(files: list[bytes], room: int, tell: Callable[[int], None] = lambda number: None) -> Fitted:
    """Return the views with the highest quality by which their files have at most `room` bytes together.

    `tell` is called with the number of each view, from 1, before it is encoded again.

    Raises
    ------
    InputError
        If they do not fit with a quarter of the pixels along each side.
    """
    if sum(map(len, files)) <= room:
        return Fitted(files, _FIRST, 1.0)
    chosen = files[:: max(len(files) // _SAMPLE, 1)]
    for scale in _SCALES:
        pixels = [_reduced(_decoded(each), scale) for each in chosen]
        for quality in _QUALITIES:
            average = sum(len(_encoded(each, quality)) for each in pixels) / len(pixels)
            if _RESERVE * average * len(files) > room:
                continue
            again = []
            for number, each in enumerate(files, 1):
                tell(number)
                again.append(_encoded(_reduced(_decoded(each), scale), quality))
            if sum(map(len, again)) <= room:
                return Fitted(again, quality, scale)
    megabytes = room / 1e6
    raise InputError(
        f"{len(files)} views do not fit in {megabytes:.3g} MB: give a smaller --size, or --orbit fewer views"
    )


def _reduced(pixels: NDArray[np.uint8], scale: float) -> NDArray[np.uint8]:
    """Return the pixels with sides that are `scale` times as long."""
    if scale == 1:
        return pixels
    import OpenImageIO as oiio

    height, width = (max(round(scale * length), 1) for length in pixels.shape[:2])
    small = oiio.ImageBufAlgo.resize(oiio.ImageBuf(pixels), roi=oiio.ROI(0, width, 0, height, 0, 1, 0, 3))
    return np.ascontiguousarray(small.get_pixels(oiio.UINT8))


def _encoded(pixels: NDArray[np.uint8], quality: int) -> bytes:
    import OpenImageIO as oiio

    height, width, channels = pixels.shape
    spec: Any = oiio.ImageSpec(width, height, channels, oiio.UINT8)
    spec.attribute("oiio:ColorSpace", "srgb_rec709_scene")
    spec.attribute("Compression", f"webp:{quality}")
    return image.stored(spec, pixels, ".webp")


def _decoded(content: bytes) -> NDArray[np.uint8]:
    """Return the pixels of an encoded view, shape (height, width, 3)."""
    # OpenImageIO reads files only.
    handle = writing.memory_file(len(content))
    try:
        os.pwrite(handle, content, 0)
        levels = image.read(f"/proc/self/fd/{handle}")[..., :3] * 255
    finally:
        os.close(handle)
    return np.rint(levels).astype(np.uint8)
