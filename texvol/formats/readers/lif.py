"""LIF (Leica): planes of one image, read by the library readlif; opening is tried in a process of its own.

readlif counts planes along x and y as images have them; its scales are planes, or pixels, for each micrometre.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.microscopy import chosen_image, spacing_of, stack
from texvol.formats.readers.samples import Choice, FileFault, Samples, check_unpacked


def read(path: str, choice: Choice) -> Samples:
    """Return the planes of one image, channel and time."""
    check_survived(lambda: _described(path, choice))
    from readlif.reader import LifFile

    image, sizes, dtype = _form(LifFile(path), path, choice)

    def plane(time: int, channel: int, number: int) -> np.ndarray:
        found = np.asarray(image.get_frame(z=number, t=time, c=channel))
        return found.astype(dtype, copy=False)

    values, _ = stack(sizes, dtype, choice, plane)
    scales = [None if not each else 1 / float(each) for each in image.info["scale"][:3]]
    return Samples(values, **spacing_of(scales), notes=(f"image {image.info['name']}",))


def _described(path: str, choice: Choice) -> None:
    from readlif.reader import LifFile

    _form(LifFile(path), path, choice)


def _form(file: Any, path: str, choice: Choice) -> tuple[Any, dict[str, int], np.dtype]:
    """Return the image, its sizes and type."""
    images = file.image_list
    if not images:
        raise FileFault("has no image")
    names = [str(each["name"]) for each in images]
    image = file.get_image(chosen_image(names, choice))
    if image.offsets[1] <= 0 or sum(image.offsets) > os.path.getsize(path):
        raise FileFault(f"is truncated: image {image.info['name']} has no pixels, or not all of them")
    depths = {int(each) for each in image.info["bit_depth"]}
    if len(depths) != 1 or not depths <= set(range(1, 17)):
        raise FileFault(f"must have pixels of up to 16 bits, got {', '.join(map(str, sorted(depths)))}")
    if int(getattr(image.info["dims"], "m", 1)) > 1:
        raise FileFault(f"has {image.info['dims'].m} tiles of a mosaic, which texvol does not read")
    dims = image.info["dims"]
    sizes = {"T": int(dims.t), "C": int(image.info["channels"]), "Z": int(dims.z), "Y": int(dims.y), "X": int(dims.x)}
    dtype = np.dtype(np.uint8 if max(depths) <= 8 else np.uint16)
    if min(sizes.values()) < 1:
        raise FileFault(f"every dimension must be positive, got {sizes}")
    check_unpacked(int(np.prod([float(each) for each in sizes.values()])) * dtype.itemsize, os.path.getsize(path))
    return image, sizes, dtype
