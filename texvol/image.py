"""Pictures in and out, through OpenImageIO.

In the program a picture is (height, width, 4) float, premultiplied, linear, top row first. EXR files hold just that,
as float32, with facts about the scene as attributes. PNG and JPEG hold it over its background, as sRGB in 8 bits;
a PNG without a background keeps its opacity and holds straight colour.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from texvol import writing
from texvol.errors import InputError
from texvol.terminal import one_line

FORMATS = (".exr", ".png", ".jpg", ".jpeg")
_PNG_FILTER_UP = 16
_ROWS_AT_ONCE = 64  # of a picture; what is worked out on the way stays in the processor's cache


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise InputError if a picture can't be written to `path`: asked before the work of making one."""
    if Path(path).suffix.lower() not in FORMATS:
        raise InputError(f"{path}: a picture's name ends with one of {', '.join(FORMATS)}")
    writing.check_writable(path)


def write(
    path: str | os.PathLike[str],
    picture: NDArray,
    attributes: Mapping[str, str] | None = None,
    *,
    transparent: bool = False,
) -> None:
    """Write a picture beside `path`, then give it its name, so that no reader sees half of it; see `encoded`.

    Raises
    ------
    InputError
        If the file can't be written, a full disk included.
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
    """The bytes of a picture file whose format is that of the name `path`.

    Parameters
    ----------
    picture : array of shape (height, width, 4)
        Premultiplied, linear, top row first, background included.
    attributes : mapping
        Text to keep in the file's header.
    transparent : bool
        Whether a PNG keeps the opacity; EXR always does, JPEG never.
    quick : bool
        Whether time matters more than bytes.
    """
    kind = Path(path).suffix.lower()
    if kind == ".exr":
        pixels: NDArray = np.ascontiguousarray(picture, np.float32)
    else:
        pixels = eight_bits(picture, transparent and kind == ".png")
    try:
        return _encoded(pixels, kind, attributes or {}, quick)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None


def read(path: str | os.PathLike[str]) -> NDArray[np.float32]:
    """Pixels as they stand in the file, (height, width, channels) float32; 8 bits become [0, 1], sRGB stays sRGB."""
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(os.fspath(path))
    if source is None:
        raise InputError(f"{path}: cannot be read: {one_line(oiio.geterror())}")
    pixels = source.read_image(oiio.FLOAT)
    reason = source.geterror()
    source.close()
    if pixels is None:
        raise InputError(f"{path}: cannot be read: {one_line(reason)}")
    return np.asarray(pixels)


def eight_bits(picture: NDArray, transparent: bool = False) -> NDArray[np.uint8]:
    """sRGB of a linear premultiplied picture, (height, width, 3), or 4 channels with straight colour if transparent."""
    if not transparent:
        return _srgb_levels(picture[..., :3])
    opacity = np.clip(picture[..., 3:], 0, 1)
    color = np.divide(picture[..., :3], opacity, out=np.zeros_like(picture[..., :3]), where=opacity > 0)
    return np.concatenate([_srgb_levels(color), np.rint(opacity * 255).astype(np.uint8)], axis=2)


def _srgb_levels(linear: NDArray) -> NDArray[np.uint8]:
    """The nearest of 255 levels to the sRGB encoding of (height, width, channels); what is no number is black.

    Looked up, because powers take as long as the rest of a PNG: the level at which the numbers begin that share the
    first half of their bits, and the number from which it is one more; they are too close together for two.
    """
    first_level, next_level_from = _level_table()
    levels = np.empty(linear.shape, np.uint8)
    for row in range(0, len(linear), _ROWS_AT_ONCE):
        part = np.ascontiguousarray(linear[row : row + _ROWS_AT_ONCE], np.float32)
        half = part.view(np.uint32) >> 16
        levels[row : row + _ROWS_AT_ONCE] = first_level.take(half) + (part >= next_level_from.take(half))
    return levels


@cache
def _level_table() -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    exact = linear_from_srgb((np.arange(1, 256) - 0.5) / 255)
    levels_from = exact.astype(np.float32)
    levels_from = np.where(levels_from < exact, np.nextafter(levels_from, np.float32(1)), levels_from)
    first = (np.arange(1 << 16, dtype=np.uint32) << 16).view(np.float32)
    level = np.where(first > 0, np.searchsorted(levels_from, first, side="right"), 0)
    return level.astype(np.uint8), np.append(levels_from, np.float32(np.nan))[level]  # nothing is brighter than 255


def srgb_from_linear(linear: NDArray) -> NDArray:
    """sRGB encoding (IEC 61966-2-1) of linear light, clipped to [0, 1]."""
    linear = np.clip(np.nan_to_num(linear), 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def linear_from_srgb(encoded: NDArray) -> NDArray:
    """Linear light of sRGB values in [0, 1] (IEC 61966-2-1)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def _encoded(pixels: NDArray, kind: str, attributes: Mapping[str, str], quick: bool) -> bytes:
    """The bytes of a picture file of `kind`, such as ".png"."""
    import OpenImageIO as oiio

    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.FLOAT if pixels.dtype == np.float32 else oiio.UINT8)
    for name, text in attributes.items():
        spec.attribute(name, text)
    if pixels.dtype == np.uint8:
        spec.attribute("oiio:ColorSpace", "srgb_rec709_scene")
        spec.attribute("oiio:UnassociatedAlpha", 1)  # the pixels are straight already
        spec.attribute("Compression", "jpeg:95" if kind in (".jpg", ".jpeg") else "zip")
        # 4 takes a third of the time of the usual 6 for a tenth more bytes. 1 with the difference of rows, which leaves
        # deflate less to look for, takes a third of that again for a third more.
        spec.attribute("png:compressionLevel", 1 if quick else 4)
        if quick:
            spec.attribute("png:filter", _PNG_FILTER_UP)
    else:
        spec.attribute("oiio:ColorSpace", "lin_rec709_scene")
        spec.attribute("Compression", "zip")
    with _scratch_file(kind, pixels.nbytes + (1 << 16)) as scratch:
        output = oiio.ImageOutput.create(kind[1:])
        if output is None:
            raise InputError(f"this OpenImageIO writes no {kind}: {one_line(oiio.geterror())}")
        if not (output.open(scratch, spec) and output.write_image(pixels) and output.close()):
            raise InputError(f"the picture cannot be encoded as {kind}: {one_line(output.geterror())}")
        return Path(scratch).read_bytes()


@contextmanager
def _scratch_file(kind: str, most_bytes: int) -> Iterator[str]:
    """Name of a file to encode into, in memory where the system can.

    Out of room libjpeg ends the process and libpng says nothing: so it is not the picture's own file, and room for
    `most_bytes` is made sure of first.
    """
    if hasattr(os, "memfd_create"):
        handle = os.memfd_create("texvol")
        try:
            os.ftruncate(handle, most_bytes)
            os.ftruncate(handle, 0)
            yield f"/proc/self/fd/{handle}"
        finally:
            os.close(handle)
    else:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"picture{kind}"
            path.write_bytes(bytes(most_bytes))
            yield str(path)
