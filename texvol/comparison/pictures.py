"""Pictures to be compared, from files or arrays: linear and premultiplied, with what their number format rounds away.

A file of whole numbers holds sRGB unless it says otherwise, and straight colour unless it says otherwise; one of
floating point holds linear light, premultiplied. Half a step of the format, taken through the same decoding, is the
farthest that rounding can have moved a pixel: it is known for each, and no difference is made of it.
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
from texvol.util.terminal import held_back_stderr, one_line

FORMATS = {"openexr": "EXR", "png": "PNG", "tiff": "TIFF", "jpeg": "JPEG"}
_MOST_PIXELS = 1 << 28  # four channels of float32 are 4 GB: more is a broken header
# Compressed pixels are unpacked where that makes them no more than so many times as large: deflate reaches 1032. So
# many bytes do no harm in any case.
_BEST_PACKING, _UNPACKED_ANYWAY = 2000, 1 << 24
_LARGEST_TILE = 1 << 20  # pixels, of a picture that is smaller: tiles are unpacked as a whole
_LINEAR, _SRGB = ("lin", "linear", "scene_linear", "raw"), ("srgb", "g22", "rec709", "gamma")


@dataclass(frozen=True)
class Picture:
    """One of two pictures that are compared.

    Attributes
    ----------
    pixels : array of shape (height, width, 4)
        float32, premultiplied, linear, top row first. Opacity is 1 where there is none; grey is in all three colours.
    channels : int
        Channels of the file or array, 1 to 4.
    has_opacity : bool
    rounding : array of shape (height, width, 4)
        Half a step of the number format at each pixel, in linear light; 0 for float32.
    whole_numbers : bool
        Whether the format ends at 1, as 8 bits do.
    is_straight : bool
        Whether colour is that before it is multiplied by opacity, also where the format stores the encoded product.
    grid : str
        The numbers that the format rounds to: two pictures of one grid that are nearly the same round alike.
    container : str
        "EXR", "PNG", "TIFF", "JPEG" or "array".
    lossy : bool
        Whether the file is a JPEG, whose pixels are not those that were written.
    words : str
        What it is: "PNG, 8 bits, sRGB, RGB".
    attributes : mapping
        The texts of the header.
    name : str
        Its path, or what it is called.
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

    @classmethod
    def of_array(
        cls, array: ArrayLike, name: str = "picture", attributes: Mapping[str, str] | None = None, *, srgb: bool = False
    ) -> Picture:
        """A picture of an array (height, width) or (height, width, 1 to 4 channels).

        Of floating point it is linear and premultiplied, as `texvol.render` gives it, or with `srgb` straight and
        encoded. uint8 and uint16 are always that.

        Raises
        ------
        InputError
            If the array is none of these, or has no pixels.
        """
        pixels = np.asarray(array)
        pixels = pixels[..., np.newaxis] if pixels.ndim == 2 else pixels
        if pixels.ndim != 3 or not 1 <= pixels.shape[2] <= 4 or pixels.size == 0:
            raise InputError(f"{name}: a picture is (height, width) or (height, width, 1 to 4), and not {pixels.shape}")
        if pixels.dtype not in (np.uint8, np.uint16) and pixels.dtype.kind != "f":
            raise InputError(f"{name}: a picture is of uint8, uint16 or floating point, and not {pixels.dtype}")
        kind = _Kind("array", pixels.dtype.name, pixels.shape[2] in (2, 4))
        if kind.steps:
            pixels, kind.is_srgb, kind.is_straight = pixels / kind.steps, True, True
        elif srgb:
            kind.is_srgb, kind.is_straight = True, True
        return _decoded(pixels, kind, name, attributes or {})


@dataclass
class _Kind:
    """How a file or array holds a picture."""

    container: str
    number: str  # numpy's name of the type
    has_opacity: bool
    is_srgb: bool = False
    is_straight: bool = False
    bits: int = 0
    gamma: float = 0.0  # linear light is the stored number to this power, where the header says so

    def __post_init__(self) -> None:
        self.bits = self.bits or {"uint8": 8, "uint16": 16, "uint32": 32}.get(self.number, 0)

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
        """Linear light of what is stored, mirrored below 0, where powers have no value."""
        if not (self.is_srgb or self.gamma):
            return encoded
        with np.errstate(invalid="ignore"):
            size = np.abs(encoded)
            light = size**self.gamma if self.gamma else linear_from_srgb(size)
            return np.asarray(np.sign(encoded) * light, np.float32)


def read_picture(path: str | os.PathLike[str]) -> Picture:
    """The picture in an EXR, PNG, TIFF or JPEG file.

    Raises
    ------
    InputError
        If it can't be read, is cut short, or holds something else than one flat picture of at most four channels.
    """
    name = os.fspath(path)
    try:
        name.encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(f"{name!r}: is no name in UTF-8, which OpenImageIO wants") from None
    _check_file(Path(path))
    with held_back_stderr() as printed:
        try:
            picture = _read(name)
        except UnicodeDecodeError:  # a library's message, or a text of the header, with bytes of a broken file in it
            raise InputError(f"{name}: cannot be read: its header is broken") from None
        printed.seek(0)
        complaints = printed.read().decode("utf-8", "replace")
    # Of a damaged picture libjpeg prints that it is damaged, and returns grey for the rest.
    if "orrupt" in complaints or "remature" in complaints:
        raise InputError(f"{name}: cannot be read: {one_line(complaints)}")
    return picture


def _read(name: str) -> Picture:
    import OpenImageIO as oiio

    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)  # straight colour stays so: premultiplied it is in linear light
    source = oiio.ImageInput.open(name, config)
    if source is None:
        raise InputError(f"{name}: cannot be read: {one_line(oiio.geterror())}")
    try:
        spec = source.spec()
        kind = _kind_of(spec, source.format_name(), name)
        if source.seek_subimage(1, 0):
            raise InputError(f"{name}: holds several pictures (parts or pages), and one is compared")
        source.geterror()  # that there is no second picture is no error
        source.seek_subimage(0, 0)
        pixels = source.read_image(oiio.DOUBLE if kind.number == "float64" else oiio.FLOAT)
        reason = source.geterror()
    finally:
        source.close()
    if pixels is None or reason:
        raise InputError(f"{name}: cannot be read: {one_line(reason)}")
    texts = {each.name: each.value for each in spec.extra_attribs if isinstance(each.value, str)}
    return _decoded(_in_its_window(np.asarray(pixels), spec), kind, name, texts)


def _check_file(path: Path) -> None:
    """Raise InputError where no library is needed to see that this is no whole picture."""
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder, and a picture is wanted: EXR, PNG, TIFF or JPEG")
        if path.exists() and not path.is_file():  # reading a pipe, or a device, may never end
            raise InputError(f"{path}: is no file, and a picture is wanted: EXR, PNG, TIFF or JPEG")
        with path.open("rb") as file:
            start = file.read(8)
            file.seek(max(path.stat().st_size - 4096, 0))
            end = file.read()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    # libjpeg paints what is missing grey, and libpng leaves it out, without a word.
    if start.startswith(b"\xff\xd8") and b"\xff\xd9" not in end:
        raise InputError(f"{path}: cannot be read: the JPEG is cut short")
    if start == b"\x89PNG\r\n\x1a\n" and b"IEND" not in end:
        raise InputError(f"{path}: cannot be read: the PNG is cut short")


def _kind_of(spec: Any, format_name: str, name: str) -> _Kind:
    """How the file holds its picture; InputError if it can't be compared."""
    container = FORMATS.get(format_name)
    if container is None:
        raise InputError(f"{name}: is of format {format_name}, and {', '.join(FORMATS.values())} are compared")
    if spec.deep:
        raise InputError(f"{name}: is a deep EXR, with several samples in a pixel, and flat ones are compared")
    pixels = max(spec.width * spec.height, spec.full_width * spec.full_height)
    held = os.path.getsize(name)
    if 4 * spec.nchannels * pixels > _UNPACKED_ANYWAY + _BEST_PACKING * held:
        size = f"{spec.full_width} × {spec.full_height} pixels of {spec.nchannels} channels"
        raise InputError(f"{name}: holds {held} bytes, and its header says {size}: more than they can be")
    if pixels > _MOST_PIXELS or spec.depth > 1:
        size = f"{spec.full_width} × {spec.full_height} × {spec.depth}"
        raise InputError(f"{name}: {size} pixels are too many to compare")
    if spec.tile_width * spec.tile_height * max(spec.tile_depth, 1) > max(spec.width * spec.height, _LARGEST_TILE):
        tile = f"{spec.tile_width} × {spec.tile_height}"
        raise InputError(f"{name}: has tiles of {tile} pixels, and a picture of {spec.width} × {spec.height}")
    number = {"half": "float16", "float": "float32", "double": "float64"}.get(str(spec.format), str(spec.format))
    if number not in ("uint8", "uint16", "float16", "float32", "float64"):
        raise InputError(f"{name}: has pixels of type {number}; 8 or 16 bits, half, float and double are compared")
    if container == "PNG" and number == "uint16":
        raise InputError(
            f"{name}: is a PNG of 16 bits, of which nothing says whether it is linear: use 8 bits, EXR or TIFF"
        )
    spaces = [str(spec.get_string_attribute(f"{each}:ColorSpace")) for each in ("jpeg", "tiff")]
    for space in filter(None, spaces):
        if space.upper() not in ("RGB", "YCBCR", "GRAY", "GREY", "PALETTE"):
            raise InputError(f"{name}: holds {space}, and RGB, RGBA and grey are compared")
    if spec.nchannels > 4 or (spec.nchannels in (2, 4)) != (spec.alpha_channel == spec.nchannels - 1):
        found = shown_line(", ".join(spec.channelnames))
        raise InputError(f"{name}: has channels {found}; RGB, RGBA, grey, and grey with opacity are compared")
    kind = _Kind(container, number, spec.alpha_channel >= 0, bits=_bits(spec, number))
    kind.is_srgb, kind.gamma = _encoding(spec, whole_numbers=kind.bits > 0)
    kind.is_straight = bool(spec.get_int_attribute("oiio:UnassociatedAlpha"))
    return kind


def _bits(spec: Any, number: str) -> int:
    """Bits of whole numbers, which may be fewer than the type has; 0 for floating point."""
    full = {"uint8": 8, "uint16": 16}.get(number, 0)
    return min(spec.get_int_attribute("oiio:BitsPerSample") or full, full)


def _encoding(spec: Any, *, whole_numbers: bool) -> tuple[bool, float]:
    """Whether it is sRGB, or else to which power: by the header, or what files of that kind mean by saying nothing.

    A power of 2.2 is what PNG files say that mean sRGB.
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
    """The pixels that an EXR's data window has of its display window, black where it has none."""
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
    """Linear and premultiplied pixels, and what half a step of the format is of them."""
    channels = pixels.shape[2]
    color = pixels[..., : 3 if channels > 2 else 1].astype(np.float32)
    opacity = pixels[..., -1:].astype(np.float32) if kind.has_opacity else np.ones((*pixels.shape[:2], 1), np.float32)
    color_rounding: NDArray = np.zeros((1, 1, 1), np.float32)
    is_encoded = kind.is_srgb or kind.gamma > 0
    half_step: NDArray = np.full((1, 1, 1), 0.5 / kind.steps if kind.steps else 0.0, np.float32)
    opacity_rounding: NDArray = half_step * kind.has_opacity * np.ones_like(opacity)
    if is_encoded and kind.has_opacity and not kind.is_straight:
        # Both numbers of the quotient are rounded.
        color = np.divide(color, opacity, out=np.zeros_like(color), where=opacity > 0)
        half_step = np.divide(half_step * (1 + color), opacity, out=np.zeros_like(color), where=opacity > 0)
    if kind.steps:
        color_rounding = _half_step_of_light(color, half_step, kind)
    elif kind.number == "float16":
        color_rounding = _half_spacing(color)
        opacity_rounding = _half_spacing(opacity) if kind.has_opacity else opacity_rounding
    color = kind.light(color)
    if kind.has_opacity and (kind.is_straight or is_encoded):
        # Of an opacity that was rounded to 0 no colour is known.
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
    """Half the distance of neighbours among 16-bit floats."""
    with np.errstate(invalid="ignore", over="ignore"):
        return np.nan_to_num(np.spacing(np.abs(numbers).astype(np.float16)).astype(np.float32) / 2)


def _half_step_of_light(
    encoded: NDArray[np.float32], half_step: NDArray[np.float32], kind: _Kind
) -> NDArray[np.float32]:
    """The larger of the ways that half a step of what is stored, up or down, is in linear light."""
    middle = kind.light(encoded)
    up = kind.light(encoded + half_step) - middle
    down = middle - kind.light(np.maximum(encoded - half_step, 0))
    return np.asarray(np.maximum(up, down), np.float32)
