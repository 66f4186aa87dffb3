"""Foresight of the largest error of all pixels from the errors of some."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_IN_TAIL = 30  # errors that tell how the largest ones are distributed
_HEAVIEST = 0.5  # exponent of the heaviest tail that is believed, and where there is no second error


def beyond_sample(errors: NDArray[np.floating], pixels: int) -> float:
    """Return the likely ratio of the largest error of all pixels to that of some of them, at least 1.

    If errors beyond x are as frequent as x^(-1/ξ), the largest of N grows with N^ξ. ξ is the mean logarithm of the
    largest errors, relative to the next one: Hill (1975), "A simple general approach to inference about the tail of a
    distribution", Annals of Statistics 3.

    Parameters
    ----------
    errors : array
        Errors of some pixels, not negative.
    pixels : int
        Number of all pixels.
    """
    largest = np.sort(errors, axis=None)[::-1].astype(np.float64)
    largest = largest[largest > 0]
    if not largest.size or not np.isfinite(largest[0]):
        return 1.0
    count = min(_IN_TAIL, largest.size - 1)
    exponent = float(np.log(largest[:count] / largest[count]).mean()) if count else _HEAVIEST
    return float(max(pixels / errors.size, 1.0) ** min(exponent, _HEAVIEST))
