"""Depth files: EXR with one float32 channel Z, in world units, infinite where a ray hits nothing."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.formats.pictures import image
from texvol.util import reach, writing
from texvol.util.errors import InputError
from texvol.util.terminal import library_reason

_NAMES = ("z", "depth")  # of the channel, without its layer


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise InputError if depths can't be written to `path`; called before they are computed."""
    if Path(path).suffix.lower() != ".exr":
        raise InputError(f"{path}: depths are written as EXR: the name must end with .exr")
    writing.check_writable(path)


def read(path: str | os.PathLike[str]) -> NDArray[np.float32]:
    """Return depths of shape (height, width), row 0 on top: channel Z, or the only one there is.

    Raises
    ------
    InputError
        If the file can't be read, or has several channels and none of them is Z.
    """
    import OpenImageIO as oiio

    reach.check(path)
    source = oiio.ImageInput.open(os.fspath(path))
    if source is None:
        raise InputError(f"{path}: cannot be read: {library_reason(oiio.geterror())}")
    try:
        spec = source.spec()
        names = list(spec.channelnames)
        found = [number for number, name in enumerate(names) if name.rpartition(".")[2].lower() in _NAMES]
        if spec.deep or not (found or len(names) == 1):
            got = "deep pixels" if spec.deep else f"channels {', '.join(names)}"
            raise InputError(f"{path}: depths must be a channel Z, got {got}")
        pixels = source.read_image(oiio.FLOAT)
        if pixels is None:
            raise InputError(f"{path}: cannot be read: {library_reason(source.geterror())}")
    finally:
        source.close()
    return np.ascontiguousarray(np.asarray(pixels).reshape(spec.height, spec.width, -1)[..., (found or [0])[0]])


def write(path: str | os.PathLike[str], depth: ArrayLike) -> None:
    """Write depths of shape (height, width), top row first, whole or not at all.

    Raises
    ------
    InputError
        If the name does not end with .exr, or the file can't be written.
    """
    check_writable(path)
    writing.write_files({path: encoded(path, depth)})


def encoded(path: str | os.PathLike[str], depth: ArrayLike) -> bytes:
    """Return the bytes of a file `path` with depths of shape (height, width)."""
    import OpenImageIO as oiio

    with np.errstate(over="ignore"):
        pixels = np.ascontiguousarray(depth, np.float32)[..., np.newaxis]
    height, width, _ = pixels.shape
    spec = oiio.ImageSpec(width, height, 1, oiio.FLOAT)
    spec.channelnames = ("Z",)
    spec.z_channel = 0
    spec.attribute("Compression", "zip")
    try:
        return image.stored(spec, pixels, ".exr")
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {writing.reason_of(error)}") from None
