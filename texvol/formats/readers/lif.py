"""LIF (Leica): planes of one image, read by the library liffile; opening is tried in a process of its own.

Images lie in the file in the order that their strides say, which liffile follows. Slices that run downwards have a
negative length along z, and a third axis that points the other way.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.microscopy import chosen_image, of_channel, spacing_of, stack
from texvol.formats.readers.samples import Choice, FileFault, Samples, by, check_unpacked

# Colours in sRGB of Leica's look-up tables that are a colour.
_COLORS = {
    "red": (1.0, 0.0, 0.0), "green": (0.0, 1.0, 0.0), "blue": (0.0, 0.0, 1.0), "cyan": (0.0, 1.0, 1.0),
    "magenta": (1.0, 0.0, 1.0), "yellow": (1.0, 1.0, 0.0), "gray": (1.0, 1.0, 1.0),
}  # fmt: skip


def read(path: str, choice: Choice) -> Samples:
    """Return the planes of one image, channel and time."""
    check_survived(lambda: _described(path, choice))
    with _opened(path) as file:
        image, sizes, dtype = _form(file, path, choice)
        stored = image.asarray(out="memmap")  # of the file itself, of which only what is picked is read
        # Axes of one sample are not among the image's.
        missing = [axis for axis in "TCZYX" if axis not in image.dims]
        ordered = np.expand_dims(stored, tuple(range(len(missing))))
        ordered = ordered.transpose([(*missing, *image.dims).index(axis) for axis in "TCZYX"])

        def plane(time: int, channel: int, number: int) -> np.ndarray:
            return np.asarray(ordered[time, channel, number], dtype)

        values, channel = stack(sizes, dtype, choice, plane)
        tables = [str(each.get("LUTName") or "") for each in image.xml_element.iter("ChannelDescription")]
        steps = _steps(image)
    more = of_channel(channel, sizes["C"], tables, [_COLORS.get(name.lower()) for name in tables])
    notes = (f"image {image.name}", *more.pop("notes", ()))
    return Samples(values, **spacing_of(steps), **more, notes=notes)


@contextmanager
def _opened(path: str) -> Iterator[Any]:
    from liffile import LifFile

    with LifFile(path) as file:
        if file.type.name != "LIF":  # others name further files, which nobody asked for
            raise FileFault(f"must be a LIF file, got {file.type.name}")
        yield file


def _described(path: str, choice: Choice) -> None:
    with _opened(path) as file:
        _form(file, path, choice)


def _form(file: Any, path: str, choice: Choice) -> tuple[Any, dict[str, int], np.dtype]:
    """Return the image, its sizes and type."""
    images = list(file.images)
    if not images:
        raise FileFault("has no image")
    image = images[chosen_image([str(each.name) for each in images], choice)]
    counts = [int(each.attrib["NumberOfElements"]) for each in image.xml_element.iter("DimensionDescription")]
    if min(counts, default=0) < 1:
        raise FileFault(f"every dimension must be positive, got {by(counts)}")
    dtype = np.dtype(image.dtype)
    if dtype not in (np.uint8, np.uint16, np.float32):
        raise FileFault(f"must have pixels of up to 16 bits or float32, got {dtype}")
    found = {str(axis): int(size) for axis, size in image.sizes.items()}
    check_unpacked(int(np.prod([float(each) for each in found.values()])) * dtype.itemsize, os.path.getsize(path))
    _check_axes(found)
    _check_held(image, path)
    return image, {axis: found.get(axis, 1) for axis in "TCZYX"}, dtype


def _check_held(image: Any, path: str) -> None:
    """Raise FileFault unless the file has all pixels of an image."""
    memory = image.xml_element.find("./Memory")
    block = image.parent.memory_blocks.get("" if memory is None else memory.get("MemoryBlockID"))
    held = 0 if block is None else min(block.size, os.path.getsize(path) - block.offset)
    if image.nbytes > held:
        raise FileFault(f"is truncated: image {image.name} has no pixels, or not all of them")


def _check_axes(sizes: dict[str, int]) -> None:
    """Raise FileFault unless the axes are those of a volume, of channels and of time."""
    if "S" in sizes:
        raise FileFault("has colours in each pixel, which texvol does not read")
    if sizes.get("M", 1) > 1:
        raise FileFault(f"has {sizes['M']} tiles of a mosaic, which texvol does not read")
    if unknown := sorted(set(sizes) - set("TCZYXM")):
        raise FileFault(f"has the axis {unknown[0]}, which texvol does not read")


def _steps(image: Any) -> list[float | None]:
    """Return the distances of neighbours along x, y and z in micrometres; the file has metres."""
    positions = [image.coords.get(axis) for axis in "XYZ"]
    return [None if each is None or len(each) < 2 else float(each[1] - each[0]) * 1e6 for each in positions]
