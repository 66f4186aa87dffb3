"""Fast PNG encoder for pixels, in a fraction of libpng's time for a file of the same size.

Each row is stored as its difference from the row above (filter Up, PNG specification, section 9), and compressed by
Intel's ISA-L if python-isal is installed, else by zlib. All other chunks are copied from a file of OpenImageIO.
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
_LEVEL = 1  # ISA-L's other levels, 0 and 2, are as fast; the fastest of zlib


def filled(file: bytes, texts: Mapping[str, str], pixels: NDArray[np.uint8]) -> bytes:
    """Return an 8-bit PNG, not interlaced, with further texts and the pixels of another picture.

    Parameters
    ----------
    file : bytes
        A PNG of a single pixel with as many channels; all chunks are kept but the size and the pixel.
    texts : mapping
        By keywords of at most 79 ASCII characters.
    pixels : array of shape (height, width, channels)
        Stored values, top row first.
    """
    height, width = pixels.shape[:2]
    parts = [_SIGNATURE]
    for kind, content in _chunks(file):
        if kind == b"IHDR":
            content = struct.pack(">II", width, height) + content[8:]
        elif kind == b"IDAT":  # a single pixel has one
            parts += [_chunk(b"tEXt", _text(keyword, text)) for keyword, text in texts.items()]
            content = _packed(pixels)
        parts.append(_chunk(kind, content))
    return b"".join(parts)


def _text(keyword: str, text: str) -> bytes:
    """Return the content of a text chunk; the text is cut at its first NUL, which would end it."""
    return f"{keyword}\0{text.partition(chr(0))[0]}".encode(errors="replace")


def _chunk(kind: bytes, content: bytes) -> bytes:
    """Return a chunk: length, kind, content, and a checksum of kind and content."""
    checksum = _deflate().crc32(content, zlib.crc32(kind))
    return b"".join([struct.pack(">I", len(content)), kind, content, struct.pack(">I", checksum)])


def _chunks(file: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield kind and content of each chunk."""
    start = len(_SIGNATURE)
    while start < len(file):
        length, kind = struct.unpack_from(">I4s", file, start)
        yield kind, file[start + 8 : start + 8 + length]
        start += 12 + length  # with the checksum


def _packed(pixels: NDArray[np.uint8]) -> bytes:
    """Return the content of an IDAT chunk for the pixels."""
    rows = pixels.reshape(len(pixels), -1)
    filtered = np.empty((len(rows), 1 + rows.shape[1]), np.uint8)
    filtered[:, 0] = _UP
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])  # modulo 256, as the filter is defined
    packed: bytes = _deflate().compress(filtered, _LEVEL)
    return packed


@cache
def _deflate() -> ModuleType:
    """Return the compression library, with zlib's functions."""
    try:
        return importlib.import_module("isal.isal_zlib")
    except ImportError:
        return zlib
