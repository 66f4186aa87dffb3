"""Picture files, read and written by OpenImageIO.

In the program a picture is (height, width, 4) float, premultiplied, linear, top row first. EXR files hold it as it is,
as float32, with metadata about the scene as attributes. PNG and JPEG hold it over its background, as 8-bit sRGB; a PNG
without a background keeps its opacity and holds straight colour.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures import quick_png
from texvol.util import reach, writing
from texvol.util.color import linear_from_srgb
from texvol.util.errors import InputError
from texvol.util.terminal import library_reason

FORMATS = (".exr", ".png", ".jpg", ".jpeg")
_OWN = "texvol:"  # prefix of attributes without a meaning for OpenImageIO
_HEADER_BYTES = 1 << 16  # room for the header of a file
_PIXELS_AT_ONCE = 1 << 14  # so that intermediates stay in the processor's cache


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise InputError if a picture can't be written to `path`; called before it is drawn."""
    if Path(path).suffix.lower() not in FORMATS:
        raise InputError(f"{path}: the name of a picture must end with one of {', '.join(FORMATS)}")
    writing.check_writable(path)


def write(
    path: str | os.PathLike[str],
    picture: NDArray,
    attributes: Mapping[str, str] | None = None,
    *,
    transparent: bool = False,
) -> None:
    """Write a picture, whole or not at all; see `encoded`.

    Raises
    ------
    InputError
        If the file can't be written, for example because the disk is full.
    """
    check_writable(path)
    writing.write_files({path: encoded(path, picture, attributes, transparent=transparent)})


def encoded(
    path: str | os.PathLike[str],
    picture: NDArray,
    attributes: Mapping[str, str] | None = None,
    *,
    transparent: bool = False,
    quick: bool = False,
) -> bytes:
    """Return the bytes of a picture file in the format of the name `path`.

    Parameters
    ----------
    picture : array of shape (height, width, 4)
        Premultiplied, linear, top row first, background included.
    attributes : mapping
        Text for the file's header.
    transparent : bool
        True if a PNG keeps the opacity; EXR always does, JPEG never.
    quick : bool
        True if encoding time matters more than file size.
    """
    kind = Path(path).suffix.lower()
    if kind == ".exr":
        pixels: NDArray = np.ascontiguousarray(picture, np.float32)
    else:
        pixels = eight_bits(picture, transparent and kind == ".png")
    try:
        if kind == ".png" and quick:
            return _quick_png(pixels, attributes or {})
        return _encoded(pixels, kind, attributes or {})
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {writing.reason_of(error)}") from None


def read(path: str | os.PathLike[str]) -> NDArray[np.float32]:
    """Return the pixels of a file, (height, width, channels) float32; 8 bits become [0, 1], sRGB stays sRGB."""
    import OpenImageIO as oiio

    reach.check(path)
    source = oiio.ImageInput.open(os.fspath(path))
    if source is None:
        raise InputError(f"{path}: cannot be read: {library_reason(oiio.geterror())}")
    pixels = source.read_image(oiio.FLOAT)
    reason = source.geterror()
    source.close()
    if pixels is None:
        raise InputError(f"{path}: cannot be read: {library_reason(reason)}")
    return np.asarray(pixels)


def eight_bits(picture: NDArray, transparent: bool = False) -> NDArray[np.uint8]:
    """Return sRGB of a linear premultiplied picture, (height, width, 3), or 4 channels of straight colour."""
    if not transparent:
        return _srgb_levels(picture[..., :3])
    opacity = np.clip(picture[..., 3], 0, 1)
    color = np.zeros_like(picture[..., :3])
    for channel in range(3):
        np.divide(picture[..., channel], opacity, out=color[..., channel], where=opacity > 0)
    return np.dstack([_srgb_levels(color), np.rint(opacity * 255).astype(np.uint8)])


def _srgb_levels(linear: NDArray) -> NDArray[np.uint8]:
    """Return the nearest of 255 levels to the sRGB encoding of (height, width, channels); NaN is black.

    The levels are looked up, since computing powers takes as long as the rest of a PNG. The index is the upper half of
    a float's bits; no entry contains more than one step between levels. An entry has the level in its upper half, and
    a number in its lower half such that adding the lower half of the float's bits carries where the next level begins.
    """
    table, (height, width, channels) = _level_table(), linear.shape
    levels = np.empty(linear.shape, np.uint8)
    at_once = min(max(_PIXELS_AT_ONCE // width, 1), height)
    numbers = np.empty((at_once, width, channels), np.float32)
    entries, found = np.empty(numbers.shape, np.intp), np.empty(numbers.shape, np.uint32)
    for row in range(0, height, at_once):
        part = linear[row : row + at_once]
        for channel in range(channels):  # five times faster than one copy of all channels
            numbers[: len(part), :, channel] = part[..., channel]
        bits = numbers.view(np.uint32)
        np.right_shift(bits, 16, out=entries, casting="unsafe")
        table.take(entries, out=found, mode="clip")  # no index is outside; this mode needs no copy
        found += np.bitwise_and(bits, 0xFFFF, out=bits)
        levels[row : row + at_once] = np.right_shift(found, 16, out=found)[: len(part)]
    return levels


@cache
def _level_table() -> NDArray[np.uint32]:
    exact = linear_from_srgb((np.arange(1, 256) - 0.5) / 255)
    levels_from = exact.astype(np.float32)
    levels_from = np.where(levels_from < exact, np.nextafter(levels_from, np.float32(1)), levels_from)
    first = (np.arange(1 << 16, dtype=np.uint32) << 16).view(np.float32)
    level = np.where(first > 0, np.searchsorted(levels_from, first, side="right"), 0)
    table: NDArray[np.uint32] = np.left_shift(level, 16).astype(np.uint32)
    begins = levels_from.view(np.uint32)
    within = (begins & 0xFFFF) > 0  # other levels begin with the entry
    table[begins[within] >> 16] += (1 << 16) - (begins[within] & 0xFFFF)
    return table


def _quick_png(pixels: NDArray[np.uint8], attributes: Mapping[str, str]) -> bytes:
    """Return a PNG: OpenImageIO's file, made once for many pictures, with other texts and pixels."""
    own = {name: text for name, text in attributes.items() if name.startswith(_OWN)}
    others = tuple((name, text) for name, text in attributes.items() if name not in own)
    return quick_png.filled(_png_of_a_pixel(pixels.shape[2], others), own, pixels)


@lru_cache(maxsize=1)
def _png_of_a_pixel(channels: int, attributes: tuple[tuple[str, str], ...]) -> bytes:
    return _encoded(np.zeros((1, 1, channels), np.uint8), ".png", dict(attributes))


def _encoded(pixels: NDArray, kind: str, attributes: Mapping[str, str]) -> bytes:
    """Return the bytes of a picture file of `kind`, such as ".png"."""
    import OpenImageIO as oiio

    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.FLOAT if pixels.dtype == np.float32 else oiio.UINT8)
    for name, text in attributes.items():
        spec.attribute(name, text)
    if pixels.dtype == np.uint8:
        spec.attribute("oiio:ColorSpace", "srgb_rec709_scene")
        spec.attribute("oiio:UnassociatedAlpha", 1)  # the pixels are straight already
        spec.attribute("Compression", "jpeg:95" if kind in (".jpg", ".jpeg") else "zip")
        spec.attribute("png:compressionLevel", 4)  # a third of the time of the usual 6, and a tenth more bytes
    else:
        spec.attribute("oiio:ColorSpace", "lin_rec709_scene")
        spec.attribute("Compression", "zip")
    return stored(spec, pixels, kind)


def stored(spec: Any, pixels: NDArray, kind: str) -> bytes:
    """Return the bytes of a file of `kind` as OpenImageIO writes it.

    On a full disk libjpeg ends the process and libpng reports nothing; so the encoder writes to memory that is reserved
    first.

    Raises
    ------
    OSError
        If there is no room.
    InputError
        If OpenImageIO can't encode the picture.
    """
    import OpenImageIO as oiio

    handle = writing.memory_file(pixels.nbytes + _HEADER_BYTES)
    try:
        os.ftruncate(handle, 0)
        scratch = f"/proc/self/fd/{handle}"
        output = oiio.ImageOutput.create(kind[1:])
        if output is None:
            raise InputError(f"this OpenImageIO can't write {kind}: {library_reason(oiio.geterror())}")
        if not (output.open(scratch, spec) and output.write_image(pixels) and output.close()):
            raise InputError(f"the picture cannot be encoded as {kind}: {library_reason(output.geterror())}")
        return Path(scratch).read_bytes()
    finally:
        os.close(handle)
