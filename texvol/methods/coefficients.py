"""Coefficients that the compressing methods keep, and the number of bits that they take."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from texvol.util.errors import InputError

_BITS = 32  # of a coefficient


def checked_fraction(kept: float) -> float:
    """Return `kept`, or raise InputError unless it is above 0 and at most 1."""
    if not 0 < kept <= 1:
        raise InputError(f"kept must be above 0 and at most 1, got {kept!r}")
    return kept


def keep_largest(coefficients: NDArray[np.float32], kept: float) -> None:
    """Set all but the largest coefficients to 0, in place; `kept` is the fraction that is kept.

    The transforms are orthonormal, so that no other choice of as many has a smaller mean square error of the values.
    """
    dropped = coefficients.size - round(kept * coefficients.size)
    if dropped:
        coefficients[np.argpartition(np.abs(coefficients), dropped)[:dropped]] = 0


def bits_per_voxel(coefficients: NDArray[np.float32], samples: int) -> float:
    """Return the bits for each of so many samples: of the coefficients that are not 0, and of their places.

    The places are a bit map, coded by its entropy.
    """
    kept = int(np.count_nonzero(coefficients))
    fraction = kept / coefficients.size
    entropy = sum(-each * math.log2(each) for each in (fraction, 1 - fraction) if each > 0)
    return (_BITS * kept + entropy * coefficients.size) / samples
