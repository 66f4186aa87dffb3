"""Pictures for a page: PNG bytes, data: URLs, and errors in false colours on a logarithmic scale."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures.page_pictures import colored, data_url, png

__all__ = ["data_url", "decades", "false_color", "png", "scale_bar"]

_LEAST_DECADE = -5  # what is less than 1e-5 does not show


def decades(largest: float) -> tuple[int, int]:
    """Powers of ten that the colour scale begins and ends with, for errors up to `largest`."""
    top = int(np.ceil(np.log10(largest))) if np.isfinite(largest) and largest > 0 else 0
    return _LEAST_DECADE, int(np.clip(top, _LEAST_DECADE + 2, 1))


def false_color(errors: NDArray, scale: tuple[int, int]) -> bytes:
    """PNG file of an error map (height, width), coloured by the logarithm of the error."""
    low, high = scale
    with np.errstate(divide="ignore"):
        fractions = (np.log10(errors) - low) / (high - low)
    return png(colored(np.clip(np.nan_to_num(fractions, nan=1.0, posinf=1.0, neginf=0.0), 0, 1)))


def scale_bar() -> bytes:
    """PNG file of the colours, least to largest error, left to right."""
    return png(colored(np.linspace(0, 1, 512)[np.newaxis].repeat(16, axis=0)))
