"""Arrays that objects keep: read-only, and where somebody else may still write to one, with a check that nobody did.

An array is not copied, since volumes are large. What was made of it (textures, ranges, histograms) is kept by the
identity of the object that holds it, and would be that of the old numbers. So each picture asks for a checksum: of a
small array all of it, of a larger one 1 MiB in blocks of 512 bytes at places spread over it, some 0.1 ms. A change of a
few samples in a large array may be missed.
"""

from __future__ import annotations

import zlib
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.util.errors import InputError

_BLOCK = 512  # bytes; neighbours along a row change together
_BLOCKS = 2048
_BINS = 61  # words of 8 bytes: prime, so that samples that trade places do so between bins


def read_only(array: NDArray) -> NDArray:
    """The same array, through which nothing can be written."""
    if not array.flags.writeable:
        return array
    view = array.view()
    view.flags.writeable = False
    return view


def shared(*pairs: tuple[NDArray | None, Any]) -> list[NDArray]:
    """Those of pairs of a kept array and what it was made of whose memory somebody else may have."""
    return [
        kept
        for kept, given in pairs
        if kept is not None and (not isinstance(given, np.ndarray) or np.may_share_memory(kept, given))
    ]


class KeepsArrays:
    """Base of objects whose arrays are read-only: they are so again in a copy, and in another process."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        for kept in state.values():
            if isinstance(kept, np.ndarray):
                kept.flags.writeable = False
        self.__dict__.update(state)


class Unchanged:
    """The promise that arrays stay as they were when they were first looked at.

    Parameters
    ----------
    arrays : arrays
        C-contiguous, and somebody else's: to those that nobody else has nothing can happen.
    """

    def __init__(self, *arrays: NDArray) -> None:
        self._arrays = arrays
        self._sums: tuple[int, ...] | None = None

    def check(self, name: str, what: str) -> None:
        """Raise InputError if a checksum is not what it was the first time; `what` they are, of the object `name`."""
        if not self._arrays:
            return
        sums = tuple(map(checksum, self._arrays))
        if self._sums is None:
            self._sums = sums
        elif sums != self._sums:
            raise InputError(
                f"{name}: its {what} were changed in place, and what was made of them is out of date: "
                f"make a new {'Mask' if what == 'weights' else 'Volume'} of the array, which is not copied for it"
            )


def checksum(array: NDArray) -> int:
    """A number that differs, as good as always, where the bytes looked at do."""
    raw = array.reshape(-1).view(np.uint8)
    if raw.size <= _BLOCK * _BLOCKS:
        words = raw[: raw.size // 8 * 8].view(np.uint64)
        rest = raw[words.size * 8 :]
    else:
        blocks = raw[: raw.size // _BLOCK * _BLOCK].reshape(-1, _BLOCK)
        words = blocks.take(_positions(len(blocks)), axis=0).reshape(-1).view(np.uint64)
        rest = raw[-_BLOCK:]
    whole = words.size // _BINS * _BINS
    bins = words[:whole].reshape(-1, _BINS).sum(axis=0, dtype=np.uint64)  # modulo 2^64
    return zlib.crc32(rest.data, zlib.crc32(words[whole:].data, zlib.crc32(bins.data)))


@lru_cache(maxsize=16)
def _positions(count: int) -> NDArray[np.intp]:
    """Numbers of blocks, one at random in each of as many strata, so that no row or slice is always passed over."""
    within = np.random.default_rng(count).random(_BLOCKS)
    return ((np.arange(_BLOCKS) + within) * (count / _BLOCKS)).astype(np.intp)
