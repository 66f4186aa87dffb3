"""GIPL (Guy's Image Processing Lab): a header of 256 bytes, big-endian, and samples after it, perhaps all in gzip.

Read without ITK, and held against it by the tests: axes are straight, and world coordinates are ITK's, x to the left, y
to the back, z to the head.
"""

from __future__ import annotations

import struct

import numpy as np

from texvol.formats.readers.samples import Choice, FileFault, Samples, pick
from texvol.formats.readers.stored import Stored, encoding_of, header_of, read_picked

_HEADER_BYTES = 256
MARKS = (0x2AE389B8, 0xEFFFE9B0)  # magic numbers at byte 252
_TYPES = {1: "u1", 7: "i1", 8: "u1", 15: ">i2", 16: ">u2", 31: ">u4", 32: ">i4", 64: ">f4", 65: ">f8"}


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of a `.gipl` or `.gipl.gz`."""
    encoding = encoding_of(path)
    head = header_of(path, encoding, _HEADER_BYTES)
    (mark,) = struct.unpack_from(">I", head, 252)
    if mark not in MARKS:
        raise FileFault(f"has no GIPL header: its magic number is {mark:#x}")
    sizes = [max(size, 1) for size in struct.unpack_from(">4H", head, 0)]
    (kind,) = struct.unpack_from(">H", head, 8)
    if kind not in _TYPES:
        raise FileFault(f"its image type must be one of {', '.join(map(str, _TYPES))}, got {kind}")
    spacing, origin = struct.unpack_from(">4f", head, 10), struct.unpack_from(">4d", head, 204)
    axes = "TZYX" if sizes[3] > 1 else "ZYX"
    shape = tuple(sizes[: len(axes)][::-1])
    stored = Stored(path, np.dtype(_TYPES[kind]), shape, encoding, skip=_HEADER_BYTES)
    values = read_picked(stored, pick(axes, shape, choice), choice)
    return Samples(values, spacing[:3], origin[:3], unit="mm", space="left-posterior-superior")
