"""Raw samples, without a header: the user says how many there are and of what type."""

from __future__ import annotations

import numpy as np

from texvol.formats.readers.samples import Choice, FileFault, Samples
from texvol.formats.readers.stored import read_stored


def read(path: str, choice: Choice) -> Samples:
    """Samples of a raw file, plain or packed by gzip or bzip2, x running fastest."""
    if choice.shape is None or choice.dtype is None:
        raise FileFault("is raw and has no header: say --shape NX,NY,NZ and --dtype TYPE")
    if len(choice.shape) != 3 or any(int(size) != size or size < 1 for size in choice.shape):
        raise FileFault(f"--shape is three positive whole numbers NX,NY,NZ, and is {','.join(map(str, choice.shape))}")
    if choice.channel or choice.time:
        raise FileFault("is raw, with three axes: there is no --channel or --time to choose")
    try:
        dtype = np.dtype(choice.dtype)
    except (TypeError, ValueError, SyntaxError):
        raise FileFault(
            f"--dtype {choice.dtype} is not a type that numpy knows: say uint8, <i2, >i2 (big-endian), float32 …"
        ) from None
    return Samples(read_stored(path, dtype, choice.shape[::-1], encoding=_encoding(path), what="it"))


def _encoding(path: str) -> str:
    with open(path, "rb") as file:
        head = file.read(3)
    lower = path.lower()
    for ending, magic, encoding in ((".gz", b"\x1f\x8b", "deflate"), (".bz2", b"BZh", "bzip2")):
        if lower.endswith(ending):
            if not head.startswith(magic):
                raise FileFault(f"is named {ending}, but its content is not compressed that way")
            return encoding
    return "raw"
