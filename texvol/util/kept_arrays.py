"""Read-only arrays that objects keep, with a check that nobody changed a shared one.

Arrays are not copied, since volumes are large. Textures, ranges and histograms of an array are cached by the identity
of the object that holds the array, and would be out of date after a change. So each picture compares a checksum: of a
small array all bytes, of a larger one 1 MiB in blocks of 512 bytes spread over it, in some 0.1 ms. A change of a few
samples in a large array may be missed.
"""

from __future__ import annotations

import zlib
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.util.errors import InputError

_BLOCK = 512  # bytes
_BLOCKS = 2048
_BINS = 1021  # words of 8 bytes: prime, so that samples that swap positions swap bins


def read_only(array: NDArray) -> NDArray:
    """Return a read-only view of the array, or the array itself if it is read-only."""
    if not array.flags.writeable:
        return array
    view = array.view()
    view.flags.writeable = False
    return view


class KeepsArrays:
    """Base of objects with read-only arrays; the arrays are read-only in copies and in other processes, too."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        for kept in state.values():
            if isinstance(kept, np.ndarray):
                kept.flags.writeable = False
        self.__dict__.update(state)


class Unchanged:
    """Check that arrays still have the values of the first check.

    Parameters
    ----------
    pairs : (kept array, argument that it was made from)
        C-contiguous arrays, or None; those that share no memory with their argument need no check.
    """

    def __init__(self, *pairs: tuple[NDArray | None, Any]) -> None:
        self._arrays = [
            kept
            for kept, given in pairs
            if kept is not None and (not isinstance(given, np.ndarray) or np.may_share_memory(kept, given))
        ]
        self._sums: tuple[int, ...] | None = None

    def check(self, name: str, what: str) -> None:
        """Raise InputError if a checksum differs from the first one; `what` names the arrays of the object `name`."""
        if not self._arrays:
            return
        sums = tuple(map(checksum, self._arrays))
        if self._sums is None:
            self._sums = sums
        elif sums != self._sums:
            raise InputError(
                f"{name}: {what} were changed in place, so that textures and statistics of them are out of date: "
                f"make a new {'Mask' if what == 'weights' else 'Volume'} of the array"
            )


def checksum(array: NDArray) -> int:
    """Return a checksum of the array's bytes, or of 1 MiB of them."""
    raw = array.reshape(-1).view(np.uint8)
    if raw.size <= _BLOCK * _BLOCKS:
        return checksum_of_all(array)
    blocks = raw[: raw.size // _BLOCK * _BLOCK].reshape(-1, _BLOCK)
    return _checksum(blocks.take(_positions(len(blocks)), axis=0).reshape(-1).view(np.uint64), raw[-_BLOCK:])


def checksum_of_all(array: NDArray) -> int:
    """Return a checksum of all bytes of a contiguous array, which each change of a single number changes.

    Of 4 MiB it takes a tenth of the time of a CRC-32.
    """
    raw = array.reshape(-1).view(np.uint8)
    words = raw[: raw.size // 8 * 8].view(np.uint64)
    return _checksum(words, raw[words.size * 8 :])


def _checksum(words: NDArray[np.uint64], rest: NDArray[np.uint8]) -> int:
    whole = words.size // _BINS * _BINS
    bins = words[:whole].reshape(-1, _BINS).sum(axis=0, dtype=np.uint64)  # modulo 2^64
    return zlib.crc32(rest.data, zlib.crc32(words[whole:].data, zlib.crc32(bins.data)))


@lru_cache(maxsize=16)
def _positions(count: int) -> NDArray[np.intp]:
    """Return block numbers, one at random in each of equally many strata, so that no row or slice is left out."""
    within = np.random.default_rng(count).random(_BLOCKS)
    return ((np.arange(_BLOCKS) + within) * (count / _BLOCKS)).astype(np.intp)
