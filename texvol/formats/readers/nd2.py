"""ND2 (Nikon): planes of one position, read by the library nd2; opening is tried in a process of its own.

A stack that was taken from its top to its bottom has a third axis that points the other way. The library shows frames
that a file lacks as 0: which those are is read from the map of chunks that ends a file.
"""

from __future__ import annotations

import os
import re
import struct
from typing import Any

import numpy as np

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.microscopy import chosen_image, note_on_missing, of_channel, spacing_of, stack
from texvol.formats.readers.samples import Choice, FileFault, Samples, check_unpacked, real_type

_MAGIC = b"\xda\xce\xbe\x0a"
_CHUNK = struct.Struct("<4sIQ")  # mark, bytes of the name and of the data, which follow
_MAP_NAME, _MAP_PLACE = b"ND2 FILEMAP SIGNATURE NAME 0001!", struct.Struct("<Q")  # the latter ends the file
_FRAME = re.compile(rb"ImageDataSeq\|(\d+)!(.{16})", re.DOTALL)
_BEFORE_DATA = 4088  # of a frame: the chunk's head and name


def read(path: str, choice: Choice) -> Samples:
    """Return the planes of one position, channel and time."""
    check_survived(lambda: _described(path, choice))
    import nd2

    held = _held(path)
    with nd2.ND2File(path) as file:
        position, sizes, dtype = _form(file, path, choice)
        frames = _frames(file, position)
        shape = (sizes["C"], sizes["Y"], sizes["X"])
        missing: list[int] = []

        def plane(time: int, channel: int, number: int) -> np.ndarray:
            frame = frames.get((time, number))
            if frame is None or (held is not None and frame not in held):
                missing.append(number)
                return np.zeros(shape[1:], dtype)
            return np.reshape(file.read_frame(frame), shape)[channel]

        values, channel = stack(sizes, dtype, choice, plane)
        steps = _steps(file)
        named = [each.channel for each in getattr(file.metadata, "channels", None) or ()]
    more = of_channel(channel, sizes["C"], [str(each.name) for each in named], [_color(each.color) for each in named])
    notes = (*more.pop("notes", ()), *note_on_missing(missing, sizes["Z"], "this position and time"))
    return Samples(values, **spacing_of(steps), **more, notes=notes)


def _held(path: str) -> set[int] | None:
    """Return the numbers of the frames that lie in the file, or None of a file without a map, as of before 2012."""
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            return None
        file.seek(max(0, size - _MAP_PLACE.size))
        (place,) = _MAP_PLACE.unpack(file.read(_MAP_PLACE.size).ljust(_MAP_PLACE.size))
        file.seek(min(place, size))
        magic, *_ = _CHUNK.unpack(file.read(_CHUNK.size).ljust(_CHUNK.size))
        if magic != _MAGIC or file.read(len(_MAP_NAME)) != _MAP_NAME:
            raise FileFault("is truncated: it lacks the map of its parts, which ends it")
        entries = file.read()
    held = set()
    for number, entry in _FRAME.findall(entries):
        start, length = struct.unpack("<QQ", entry)
        # Both are the same where the length is not told.
        if start + _BEFORE_DATA + (0 if length == start else length) <= size:
            held.add(int(number))
    return held


def _described(path: str, choice: Choice) -> None:
    import nd2

    _held(path)
    with nd2.ND2File(path) as file:
        _form(file, path, choice)


def _form(file: Any, path: str, choice: Choice) -> tuple[int, dict[str, int], np.dtype]:
    """Return the position, sizes and type."""
    found = {str(axis): int(size) for axis, size in file.sizes.items()}
    if found.get("S", 1) > 1:
        raise FileFault("has colours in each pixel, which texvol does not read")
    if unknown := set(found) - set("TCZYXPS"):
        raise FileFault(f"has the axis {sorted(unknown)[0]}, which texvol does not read")
    position = chosen_image([f"position {number}" for number in range(found.get("P", 1))], choice)
    sizes = {axis: found.get(axis, 1) for axis in "TCZYX"}
    dtype = real_type(np.dtype(file.dtype))
    check_unpacked(int(np.prod([float(each) for each in found.values()])) * dtype.itemsize, os.path.getsize(path))
    return position, sizes, dtype


def _frames(file: Any, position: int) -> dict[tuple[int, int], int]:
    """Return the number of the frame of each time step and slice."""
    return {
        (int(index.get("T", 0)), int(index.get("Z", 0))): number
        for number, index in enumerate(file.loop_indices)
        if int(index.get("P", 0)) == position
    }


def _steps(file: Any) -> list[float | None]:
    """Return the distances of neighbours along x, y and z in micrometres, as far as the file tells them."""
    channels = getattr(file.metadata, "channels", None)
    told = channels[0].volume.axesCalibrated if channels else (True, True, True)
    x, y, z = (float(step) if known else None for step, known in zip(file.voxel_size(), told, strict=True))
    downwards = any(loop.type == "ZStackLoop" and not loop.parameters.bottomToTop for loop in file.experiment)
    return [x, y, -z if z is not None and downwards else z]


def _color(color: Any) -> list[float] | None:
    """Return the sRGB colour of a channel."""
    try:
        return [float(getattr(color, name)) / 255 for name in ("r", "g", "b")]
    except (AttributeError, TypeError, ValueError):
        return None
