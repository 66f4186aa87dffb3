"""Differences of pixels, and their range, for pages."""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import NDArray


def pixel_differences(candidate: NDArray, reference: NDArray) -> NDArray[np.float32]:
    """Return each pixel's largest absolute difference; infinite if either pixel is not finite."""
    with np.errstate(invalid="ignore", over="ignore"):
        channels = np.moveaxis(np.abs(candidate - reference), 2, 0)
    difference = reduce(np.maximum, channels)  # takes a fifth of the time of max(axis=2)
    return np.where(np.isnan(difference), np.float32(np.inf), difference)


def largest_finite(numbers: NDArray) -> float:
    """Return the largest finite number, or 0."""
    return float(numbers[np.isfinite(numbers)].max(initial=0))


def shown_range(reference: NDArray, scale: float) -> list[float]:
    """Return the values that are shown black and white: 0 and 1 for light, the range of the reference for numbers."""
    if scale == 1:
        return [0.0, 1.0]
    colors = reference[..., :3]
    low = float(colors[np.isfinite(colors)].min(initial=np.inf))
    return [low, low + scale] if np.isfinite(low) else [0.0, scale]
