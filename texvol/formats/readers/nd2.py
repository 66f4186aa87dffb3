"""ND2 (Nikon): planes of one position, read by the library nd2; opening is tried in a process of its own."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.microscopy import chosen_image, of_channel, spacing_of, stack
from texvol.formats.readers.samples import Choice, FileFault, Samples, check_unpacked, real_type


def read(path: str, choice: Choice) -> Samples:
    """Return the planes of one position, channel and time."""
    check_survived(lambda: _described(path, choice))
    import nd2

    with nd2.ND2File(path) as file:
        position, sizes, dtype = _form(file, path, choice)
        frames = _frames(file, position)

        def plane(time: int, channel: int, number: int) -> np.ndarray:
            if (time, number) not in frames:
                raise FileFault(f"has no plane {number} of time step {time}")
            frame = np.asarray(file.read_frame(frames[time, number]))
            return frame[channel] if frame.ndim == 3 else frame

        values, channel = stack(sizes, dtype, choice, plane)
        size = file.voxel_size()
        named = [each.channel for each in getattr(file.metadata, "channels", None) or ()]
    names = [str(each.name) for each in named]
    colors = [_color(each.color) for each in named]
    return Samples(values, **spacing_of(list(size)), **of_channel(channel, sizes["C"], names, colors))


def _described(path: str, choice: Choice) -> None:
    import nd2

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


def _color(color: Any) -> list[float] | None:
    """Return the sRGB colour of a channel."""
    try:
        return [float(getattr(color, name)) / 255 for name in ("r", "g", "b")]
    except (AttributeError, TypeError, ValueError):
        return None
