"""Pictures to be compared, from files or arrays: linear and premultiplied, with the rounding of their number format.

Files of whole numbers hold sRGB and straight colour, files of floating point linear premultiplied light, unless the
header says otherwise. Half a step of the format, decoded like the pixels, is the most that rounding can have moved a
number: it is kept for each number, and does not count as a difference.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.util.color import linear_from_srgb
from texvol.util.errors import InputError
from texvol.util.shown_text import shown_line
from texvol.util.terminal import held_back_stderr, library_reason

FORMATS = {"openexr": "EXR", "png": "PNG", "tiff": "TIFF", "jpeg": "JPEG"}
_MOST_PIXELS = 1 << 28  # 4 GB in four channels of float32; larger sizes are broken headers
# Largest ratio of unpacked to packed bytes that is read (deflate reaches 1032), and bytes that are unpacked anyway.
_BEST_PACKING, _UNPACKED_ANYWAY = 2000, 1 << 24
_LARGEST_TILE = 1 << 20  # pixels; tiles are unpacked as a whole, even in a smaller picture
_BITS = {"uint8": 8, "uint16": 16}
_LINEAR, _SRGB = ("lin", "linear", "scene_linear", "raw"), ("srgb", "g22", "rec709", "gamma")


@dataclass(frozen=True)
class Picture:
    """A picture that is compared.

    Attributes
    ----------
    pixels : array of shape (height, width, 4)
        float32, premultiplied, linear, top row first. Opacity is 1 if there is none; grey is in all three colours.
    channels : int
        Channels of the file or array, 1 to 4.
    has_opacity : bool
    rounding : array of shape (height, width, 4)
        Half a step of the number format at each number, in linear light; 0 for float32.
    whole_numbers : bool
        True if the format ends at 1, as 8 bits do.
    is_straight : bool
        True if colour was not multiplied by opacity in linear light: straight, or multiplied after encoding.
    grid : str
        Key of the numbers that the format rounds to: nearly equal pictures of one grid round alike.
    container : str
        "EXR", "PNG", "TIFF", "JPEG" or "array".
    lossy : bool
        True for a JPEG, whose pixels are not those that were written.
    words : str
        Description: "PNG, 8 bits, sRGB, RGB".
    attributes : mapping
        Texts of the header.
    name : str
        Path or name.
    """

    pixels: NDArray[np.float32]
    channels: int
    has_opacity: bool
    rounding: NDArray[np.float32]
    whole_numbers: bool = False
    is_straight: bool = False
    grid: str = ""
    container: str = "array"
    lossy: bool = False
    words: str = "array"
    attributes: Mapping[str, str] = field(default_factory=dict)
    name: str = "picture"

    @property
    def size_in_words(self) -> str:
        """Width × height."""
        return f"{self.pixels.shape[1]} × {self.pixels.shape[0]}"

    @classmethod
    def of_array(cls, array: ArrayLike, name: str = "picture", attributes: Mapping[str, str] | None = None) -> Picture:
        """Return the picture of an array (height, width) or (height, width, 1 to 4 channels).

        Floating point is linear and premultiplied, as `texvol.render` returns it; uint8 and uint16 are straight
        and encoded.

        Raises
        ------
        InputError
            If the array has another shape or type, no pixels, or masked ones.
        """
        if np.ma.is_masked(array):
            raise InputError(f"{name}: must have no masked pixels; use array.filled(value)")
        pixels = np.asarray(array)
        pixels = pixels.astype(pixels.dtype.newbyteorder("="), copy=False)  # files of another byte order
        pixels = pixels[..., np.newaxis] if pixels.ndim == 2 else pixels
        if pixels.ndim != 3 or not 1 <= pixels.shape[2] <= 4 or pixels.size == 0:
            raise InputError(f"{name}: shape must be (height, width) or (height, width, 1 to 4), got {pixels.shape}")
        if pixels.dtype not in (np.uint8, np.uint16) and pixels.dtype.kind != "f":
            raise InputError(f"{name}: type must be uint8, uint16 or floating point, got {pixels.dtype}")
        bits = _BITS.get(pixels.dtype.name, 0)
        kind = _Kind("array", pixels.dtype.name, pixels.shape[2] in (2, 4), bits, bits > 0, is_straight=bits > 0)
        pixels = pixels / kind.steps if bits else pixels
        return _decoded(pixels, kind, name, attributes or {})


@dataclass(frozen=True)
class _Kind:
    """Format of a picture in a file or array."""

    container: str
    number: str  # numpy's name of the type
    has_opacity: bool
    bits: int  # of whole numbers, which may be fewer than the type's; 0 for floating point
    is_srgb: bool
    gamma: float = 0.0  # linear light is the stored number to this power, where the header says so
    is_straight: bool = False

    @property
    def steps(self) -> int:
        """Steps from 0 to 1 of whole numbers; 0 for floating point."""
        return 2**self.bits - 1 if self.bits else 0

    def words(self, channels: int) -> str:
        names = {1: "grey", 2: "grey and opacity", 3: "RGB", 4: "RGBA"}[channels]
        floating = {"float16": "half", "float32": "float"}.get(self.number, "double")
        number = f"{self.bits} bits" if self.bits else floating
        encoding = f"gamma {self.gamma:.3g}" if self.gamma else "sRGB" if self.is_srgb else "linear"
        return f"{self.container}, {number}, {encoding}, {names}"

    def grid(self, channels: int) -> str:
        """Key of the numbers that the format rounds to."""
        _, *numbers = self.words(channels).split(", ")
        return ", ".join([*numbers, "straight"] if self.has_opacity and self.is_straight else numbers)

    def light(self, encoded: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return linear light of stored numbers, as an odd function: powers of negative numbers have no value."""
        if not (self.is_srgb or self.gamma):
            return encoded
        with np.errstate(invalid="ignore"):
            size = np.abs(encoded)
            light = size**self.gamma if self.gamma else linear_from_srgb(size)
            return np.asarray(np.sign(encoded) * light, np.float32)


def read_picture(path: str | os.PathLike[str]) -> Picture:
    """Read an EXR, PNG, TIFF or JPEG file.

    Raises
    ------
    InputError
        If the file can't be read, is cut short, or holds anything but one flat picture of at most four channels.
    """
    name = os.fspath(path)
    try:
        name.encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(f"{name!r}: the file name must be UTF-8 for OpenImageIO; rename the file") from None
    _check_file(Path(path))
    with held_back_stderr() as printed:
        try:
            picture = _read(name)
        except UnicodeDecodeError:  # a message, or a text of the header, with bytes of a broken file
            raise InputError(f"{name}: cannot be read: the header is broken") from None
        printed.seek(0)
        complaints = printed.read().decode("utf-8", "replace")
    # libjpeg reports damage on stderr only, and returns grey for the rest.
    if "orrupt" in complaints or "remature" in complaints:
        raise InputError(f"{name}: cannot be read: {library_reason(complaints)}")
    return picture


def _read(name: str) -> Picture:
    import OpenImageIO as oiio

    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)  # straight colour stays straight: it is multiplied in linear light
    source = oiio.ImageInput.open(name, config)
    if source is None:
        raise InputError(f"{name}: cannot be read: {library_reason(oiio.geterror())}")
    try:
        spec = source.spec()
        kind = _kind_of(spec, source.format_name(), name)
        if source.seek_subimage(1, 0):
            raise InputError(f"{name}: must hold one picture, got several (parts or pages)")
        source.geterror()  # clears the error of the missing second picture
        source.seek_subimage(0, 0)
        pixels = source.read_image(oiio.DOUBLE if kind.number == "float64" else oiio.FLOAT)
        reason = source.geterror()
    finally:
        source.close()
    if pixels is None or reason:
        raise InputError(f"{name}: cannot be read: {library_reason(reason)}")
    texts = {each.name: each.value for each in spec.extra_attribs if isinstance(each.value, str)}
    return _decoded(_in_its_window(np.asarray(pixels), spec), kind, name, texts)


def _check_file(path: Path) -> None:
    """Raise InputError if the file is visibly no complete picture, without a library."""
    try:
        if path.is_dir():
            raise InputError(f"{path}: must be an EXR, PNG, TIFF or JPEG file, got a folder")
        if path.exists() and not path.is_file():  # reading a pipe or a device may never end
            raise InputError(f"{path}: must be an EXR, PNG, TIFF or JPEG file, got a pipe or device")
        with path.open("rb") as file:
            start = file.read(8)
            file.seek(max(path.stat().st_size - 4096, 0))
            end = file.read()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    # libjpeg and libpng fill the missing rows without an error.
    if start.startswith(b"\xff\xd8") and b"\xff\xd9" not in end:
        raise InputError(f"{path}: cannot be read: the JPEG is cut short")
    if start == b"\x89PNG\r\n\x1a\n" and b"IEND" not in end:
        raise InputError(f"{path}: cannot be read: the PNG is cut short")


def _kind_of(spec: Any, format_name: str, name: str) -> _Kind:
    """Return the format of the file's picture; raise InputError if it can't be compared."""
    container = FORMATS.get(format_name)
    if container is None:
        raise InputError(f"{name}: the format must be {', '.join(FORMATS.values())}, got {format_name}")
    if spec.deep:
        raise InputError(f"{name}: the EXR must be flat, got a deep one with several samples in a pixel")
    pixels = max(spec.width * spec.height, spec.full_width * spec.full_height)
    held = os.path.getsize(name)
    if 4 * spec.nchannels * pixels > _UNPACKED_ANYWAY + _BEST_PACKING * held:
        size = f"{spec.full_width} × {spec.full_height} pixels of {spec.nchannels} channels"
        raise InputError(f"{name}: {held} bytes cannot hold {size}; the header is broken")
    if pixels > _MOST_PIXELS or spec.depth > 1:
        size = f"{spec.full_width} × {spec.full_height} × {spec.depth}"
        raise InputError(f"{name}: the picture must have at most {_MOST_PIXELS} pixels in one layer, got {size}")
    if spec.tile_width * spec.tile_height * max(spec.tile_depth, 1) > max(spec.width * spec.height, _LARGEST_TILE):
        tile = f"{spec.tile_width} × {spec.tile_height}"
        raise InputError(f"{name}: tiles of {tile} pixels are too large for a picture of {spec.width} × {spec.height}")
    number = {"half": "float16", "float": "float32", "double": "float64"}.get(str(spec.format), str(spec.format))
    if number not in ("uint8", "uint16", "float16", "float32", "float64"):
        raise InputError(f"{name}: pixels must be 8 or 16 bits, half, float or double, got {number}")
    if container == "PNG" and number == "uint16":
        raise InputError(
            f"{name}: PNG must have 8 bits, got 16 bits, which may be linear or sRGB; use 8 bits, EXR or TIFF"
        )
    spaces = [str(spec.get_string_attribute(f"{each}:ColorSpace")) for each in ("jpeg", "tiff")]
    for space in filter(None, spaces):
        if space.upper() not in ("RGB", "YCBCR", "GRAY", "GREY", "PALETTE"):
            raise InputError(f"{name}: colours must be RGB, RGBA or grey, got {space}")
    if spec.nchannels > 4 or (spec.nchannels in (2, 4)) != (spec.alpha_channel == spec.nchannels - 1):
        found = shown_line(", ".join(spec.channelnames))
        raise InputError(f"{name}: channels must be RGB, RGBA, grey, or grey with opacity, got {found}")
    full = _BITS.get(number, 0)
    bits = min(spec.get_int_attribute("oiio:BitsPerSample") or full, full)
    is_srgb, gamma = _encoding(spec, whole_numbers=bits > 0)
    is_straight = bool(spec.get_int_attribute("oiio:UnassociatedAlpha"))
    return _Kind(container, number, spec.alpha_channel >= 0, bits, is_srgb, gamma, is_straight)


def _encoding(spec: Any, *, whole_numbers: bool) -> tuple[bool, float]:
    """Return (is sRGB, exponent of another power law), from the header or the format's default.

    PNG files that mean sRGB give a power of 2.2.
    """
    gamma = float(spec.get_float_attribute("oiio:Gamma"))
    if gamma > 0:
        named = min((1.0, 2.2), key=lambda each: abs(each - gamma))
        return (named == 2.2, 0.0) if abs(gamma - named) < 0.05 else (False, gamma)
    space = spec.get_string_attribute("oiio:ColorSpace").lower()
    if space.startswith(_LINEAR):
        return False, 0.0
    return whole_numbers or space.startswith(_SRGB), 0.0


def _in_its_window(pixels: NDArray, spec: Any) -> NDArray:
    """Return the display window of an EXR, black outside its data window."""
    if (spec.x, spec.y, spec.width, spec.height) == (spec.full_x, spec.full_y, spec.full_width, spec.full_height):
        return pixels
    shown = np.zeros((spec.full_height, spec.full_width, spec.nchannels), pixels.dtype)
    left, top = spec.x - spec.full_x, spec.y - spec.full_y
    width, height = min(left + spec.width, spec.full_width), min(top + spec.height, spec.full_height)
    if width > max(left, 0) and height > max(top, 0):
        inside = pixels[max(-top, 0) : height - top, max(-left, 0) : width - left]
        shown[max(top, 0) : height, max(left, 0) : width] = inside
    return shown


def _decoded(pixels: NDArray, kind: _Kind, name: str, attributes: Mapping[str, str]) -> Picture:
    """Return linear premultiplied pixels, with half a step of the format as rounding."""
    channels = pixels.shape[2]
    color = pixels[..., : 3 if channels > 2 else 1].astype(np.float32)
    opacity = pixels[..., -1:].astype(np.float32) if kind.has_opacity else np.ones((*pixels.shape[:2], 1), np.float32)
    color_rounding: NDArray = np.zeros((1, 1, 1), np.float32)
    is_encoded = kind.is_srgb or kind.gamma > 0
    half_step: NDArray = np.full((1, 1, 1), 0.5 / kind.steps if kind.steps else 0.0, np.float32)
    opacity_rounding: NDArray = half_step * kind.has_opacity * np.ones_like(opacity)
    if is_encoded and kind.has_opacity and not kind.is_straight:
        # Numerator and denominator are rounded.
        color = np.divide(color, opacity, out=np.zeros_like(color), where=opacity > 0)
        half_step = np.divide(half_step * (1 + color), opacity, out=np.zeros_like(color), where=opacity > 0)
    if kind.steps:
        color_rounding = _half_step_of_light(color, half_step, kind)
    elif kind.number == "float16":
        color_rounding = _half_spacing(color)
        opacity_rounding = _half_spacing(opacity) if kind.has_opacity else opacity_rounding
    color = kind.light(color)
    if kind.has_opacity and (kind.is_straight or is_encoded):
        # An opacity rounded to 0 has an unknown colour.
        color_rounding = color_rounding * opacity + np.where(opacity > 0, color, 1) * opacity_rounding
        color = color * opacity
    shape = (*pixels.shape[:2], 3)
    linear = np.concatenate([np.broadcast_to(color, shape), opacity], axis=2)
    rounded = np.broadcast_to(color_rounding, shape), np.broadcast_to(opacity_rounding, (*shape[:2], 1))
    return Picture(
        np.ascontiguousarray(linear, np.float32),
        channels,
        kind.has_opacity,
        np.concatenate(rounded, axis=2).astype(np.float32),
        whole_numbers=kind.steps > 0,
        is_straight=kind.has_opacity and (kind.is_straight or is_encoded),
        grid=kind.grid(channels),
        container=kind.container,
        lossy=kind.container == "JPEG",
        words=kind.words(channels),
        attributes=dict(attributes),
        name=name,
    )


def _half_spacing(numbers: NDArray[np.float32]) -> NDArray[np.float32]:
    """Half the distance between neighbouring 16-bit floats."""
    with np.errstate(invalid="ignore", over="ignore"):
        return np.nan_to_num(np.spacing(np.abs(numbers).astype(np.float16)).astype(np.float32) / 2)


def _half_step_of_light(
    encoded: NDArray[np.float32], half_step: NDArray[np.float32], kind: _Kind
) -> NDArray[np.float32]:
    """Return half a step of the stored number in linear light: the larger of up and down."""
    middle = kind.light(encoded)
    up = kind.light(encoded + half_step) - middle
    down = middle - kind.light(np.maximum(encoded - half_step, 0))
    return np.asarray(np.maximum(up, down), np.float32)
