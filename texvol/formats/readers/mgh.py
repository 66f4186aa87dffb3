"""MGH and MGZ of FreeSurfer: a header of 284 bytes, big-endian, samples after it, and more that is not read.

Read without nibabel, and held against it by the tests. World coordinates are RAS+, in mm: the header has the directions
of the axes and the position of the middle of the box, half of the sizes away from the first sample.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from texvol.formats.readers.samples import Choice, FileFault, Samples, pick
from texvol.formats.readers.stored import Stored, encoding_of, header_of, read_picked

_HEADER_BYTES = 284
_TYPES = {0: "u1", 1: ">i4", 3: ">f4", 4: ">i2", 10: ">u2"}
# Of files that do not say, as in FreeSurfer: coronal slices from back to front, rows from top to bottom.
_SPACING, _COLUMNS, _MIDDLE = (1.0, 1.0, 1.0), ((-1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)), (0.0, 0.0, 0.0)


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of a `.mgh`, `.mgz` or `.mgh.gz`; frames are time steps."""
    encoding = encoding_of(path)
    head = header_of(path, encoding, _HEADER_BYTES)
    version, *sizes, frames, kind = struct.unpack_from(">6i", head)
    if version != 1:
        raise FileFault(f"has no MGH header: its version must be 1, got {version}")
    if kind not in _TYPES:
        raise FileFault(f"its type of samples must be one of {', '.join(map(str, _TYPES))}, got {kind}")
    axes = "TZYX" if frames > 1 else "ZYX"
    shape = (frames, *sizes[::-1])[-len(axes) :]
    stored = Stored(path, np.dtype(_TYPES[kind]), shape, encoding, skip=_HEADER_BYTES, is_last=False)
    values = read_picked(stored, pick(axes, shape, choice), choice)
    return Samples(values, **_grid(head, sizes), unit="mm", space="right-anterior-superior")


def _grid(head: bytes, sizes: list[int]) -> dict[str, Any]:
    spacing, columns, middle = _SPACING, _COLUMNS, _MIDDLE
    if struct.unpack_from(">h", head, 28)[0] > 0:
        numbers = struct.unpack_from(">15f", head, 30)
        spacing, middle = numbers[:3], numbers[12:]
        columns = (numbers[3:6], numbers[6:9], numbers[9:12])
    direction = np.array(columns).T
    origin = np.array(middle) - direction @ (np.array(spacing) * sizes) / 2
    return {"spacing": spacing, "direction": direction, "origin": origin.tolist()}
