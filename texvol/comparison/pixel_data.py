"""Pixels for a page's script: few bytes, four digits of every number and of every difference.

A number is stored as float32 with 14 of the 23 bits of its mantissa, so within 2^-15 of itself. That is how the
reference is stored. The candidate is stored as its difference d from the reference if |d| < |c| / 2, and as itself
otherwise, or if either is not finite. If |d| < |c| / 2, the reference r is less than 3/2 |c|, so r + d is within
2^-15 (3/2 + 1/2) of c: 6e-5; if |d| ≥ |c| / 2, both are less than 3 |d|, so c - r is within 2^-15 (2 + 3) of d: 1.5e-4.
A difference of 1e-7 between two nearly equal pictures keeps four digits, too.

Bytes of equal weight are stored together and deflated, which makes smooth or zero data small.
"""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

MANTISSA_BITS = 14
_DROPPED = 23 - MANTISSA_BITS
_NAN = 0x7FC00000 >> _DROPPED
_WHOLE = 1 << 23  # set if the candidate's own number is stored; above the sign and 8 + 14 bits of magnitude
_LEVEL = 1  # of deflate; level 6 takes three times as long for a tenth fewer bytes


def reference_data(pixels: NDArray) -> dict[str, Any]:
    """Return the data of a picture (height, width, 4)."""
    numbers = _numbers(pixels).astype(np.int32)
    steps = numbers.copy()
    steps[:, 1:] -= numbers[:, :-1]  # neighbours differ by small steps
    return _packed(((steps << 1) ^ (steps >> 31)).view(np.uint32))


def candidate_data(candidate: NDArray, reference: NDArray) -> dict[str, Any] | None:
    """Return the data of a picture relative to a reference of the same size; None if they are equal."""
    with np.errstate(invalid="ignore", over="ignore"):
        difference = (candidate.astype(np.float64) - reference).astype(np.float32)
        is_near = 2 * np.abs(difference) < np.abs(candidate)
        is_near &= np.isfinite(difference)  # infinities are stored themselves
    is_near |= difference == 0
    if not np.any(difference):
        return None
    numbers = np.where(is_near, _numbers(difference), _numbers(candidate) | _WHOLE)
    return _packed(numbers.astype(np.uint32))


def _numbers(pixels: NDArray) -> NDArray[np.uint32]:
    """Return the rounded numbers' magnitudes, with the sign as lowest bit, where it compresses best."""
    bits = np.ascontiguousarray(pixels, np.float32).view(np.uint32)
    magnitude = ((bits & 0x7FFFFFFF) + (1 << (_DROPPED - 1))) >> _DROPPED
    return np.asarray((np.minimum(magnitude, _NAN) << 1) | (bits >> 31), np.uint32)


def _packed(numbers: NDArray[np.uint32]) -> dict[str, Any]:
    """Pack numbers of 24 bits (height, width, 4); equal channels are stored once."""
    height, width = numbers.shape[:2]
    kept: list[NDArray[np.uint32]] = []
    sources: list[int] = []
    for each in np.moveaxis(numbers, 2, 0):
        same = (index for index, other in enumerate(kept) if np.array_equal(other, each))
        sources.append(next(same, len(kept)))
        if sources[-1] == len(kept):
            kept.append(np.ascontiguousarray(each, "<u4"))
    planes = np.stack(kept).view(np.uint8).reshape(-1, 4)[:, :3].T
    return {"width": width, "height": height, "channels": sources, "bytes": packed_text(planes.tobytes())}


def packed_text(content: bytes) -> str:
    """Return deflated bytes as text."""
    return base64.b64encode(zlib.compress(content, _LEVEL)).decode()
