"""The pixels of a PNG, packed in a fraction of the time that libpng takes for a file of that size.

Each row is written as its difference from the one above (filter Up, PNG specification, section 9), and packed by
Intel's ISA-L where python-isal is installed, else by zlib. Everything else in the file is left to OpenImageIO.
"""

from __future__ import annotations

import importlib
import struct
import zlib
from collections.abc import Iterator, Mapping
from functools import cache
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_UP = 2
_LEVEL = 1  # ISA-L's others, 0 and 2, pack as fast; zlib's quickest


def filled(file: bytes, texts: Mapping[str, str], pixels: NDArray[np.uint8]) -> bytes:
    """The file of a PNG in 8 bits, not interlaced, with these texts too, and with another picture's pixels.

    Parameters
    ----------
    file : bytes
        A PNG of a single pixel with as many channels: all of it is kept but its size and the pixel.
    texts : mapping
        By keywords of at most 79 ASCII characters.
    pixels : array of shape (height, width, channels)
        As they are to be read from the file, top row first.
    """
    height, width = pixels.shape[:2]
    parts = [_SIGNATURE]
    for kind, content in _chunks(file):
        if kind == b"IHDR":
            content = struct.pack(">II", width, height) + content[8:]
        elif kind == b"IDAT":  # of a single pixel there is one
            parts += [_chunk(b"tEXt", _text(keyword, text)) for keyword, text in texts.items()]
            content = _packed(pixels)
        parts.append(_chunk(kind, content))
    return b"".join(parts)


def _text(keyword: str, text: str) -> bytes:
    """What a chunk of text holds; the text goes up to its first NUL, which would end it."""
    return f"{keyword}\0{text.partition(chr(0))[0]}".encode(errors="replace")


def _chunk(kind: bytes, content: bytes) -> bytes:
    """A part of a file: its length, its kind, what it holds, and a checksum of both."""
    checksum = _deflate().crc32(content, zlib.crc32(kind))
    return b"".join([struct.pack(">I", len(content)), kind, content, struct.pack(">I", checksum)])


def _chunks(file: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Kind and content of each."""
    start = len(_SIGNATURE)
    while start < len(file):
        length, kind = struct.unpack_from(">I4s", file, start)
        yield kind, file[start + 8 : start + 8 + length]
        start += 12 + length  # with the checksum


def _packed(pixels: NDArray[np.uint8]) -> bytes:
    """What the pixels are in an IDAT chunk."""
    rows = pixels.reshape(len(pixels), -1)
    filtered = np.empty((len(rows), 1 + rows.shape[1]), np.uint8)
    filtered[:, 0] = _UP
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])  # modulo 256, as it is meant
    packed: bytes = _deflate().compress(filtered, _LEVEL)
    return packed


@cache
def _deflate() -> ModuleType:
    """The library that packs, with zlib's functions."""
    try:
        return importlib.import_module("isal.isal_zlib")
    except ImportError:
        return zlib
