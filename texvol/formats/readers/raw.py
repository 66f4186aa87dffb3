"""Raw samples without a header; the user gives dimensions and type."""

from __future__ import annotations

import os

import numpy as np

from texvol.formats.readers.samples import COUNTED, AxisLength, Choice, FileFault, Samples
from texvol.formats.readers.stored import MAGIC, Stored, encoding_of, read_stored


def read(path: str, choice: Choice) -> Samples:
    """Return the samples of a raw file, plain or compressed by gzip or bzip2, with x fastest."""
    if choice.shape is None or choice.dtype is None:
        raise FileFault("is raw and has no header: give --shape NX,NY,NZ and --dtype TYPE")
    if len(choice.shape) != 3 or any(int(size) != size or size < 1 for size in choice.shape):
        raise FileFault(
            f"--shape must be three positive whole numbers NX,NY,NZ, got {','.join(map(str, choice.shape))}"
        )
    if COUNTED in (choice.channel, choice.time):
        raise AxisLength(0)
    if choice.channel or choice.time:
        raise FileFault("is raw, with three axes: leave --channel and --time out")
    try:
        dtype = np.dtype(choice.dtype)
    except (TypeError, ValueError, SyntaxError):
        raise FileFault(
            f"--dtype must be a type of numpy, such as uint8, <i2, >i2 (big-endian) or float32, got {choice.dtype}"
        ) from None
    encoding = encoding_of(path)
    with open(path, "rb") as file:
        if not file.read(3).startswith(MAGIC[encoding]):
            ending = os.path.splitext(path)[1].lower()
            raise FileFault(f"is named {ending}, but its content is not compressed that way")
    return Samples(read_stored(Stored(path, dtype, tuple(choice.shape[::-1]), encoding)))
