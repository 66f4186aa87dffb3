"""Differences of two pictures, their limits, and their probable causes.

compare      absolute differences of two arrays, as in tests of your own
examine      a candidate and its reference: measures, broken limits, kinds of difference, the oracle's verdict
"""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.util.errors import InputError


@dataclass(frozen=True)
class Difference:
    """Absolute differences over all pixels and channels of two linear premultiplied pictures.

    A picture with a NaN or an infinity differs infinitely: `not (difference.max_error <= bound)` fails it.
    """

    max_error: float
    rms_error: float
    mean_error: float
    worst_pixel: tuple[int, int]  # (column, row)
    non_finite: int  # pixels with a NaN or an infinity in either picture


def compare(candidate: ArrayLike, reference: ArrayLike) -> Difference:
    """Return the difference of two pictures of the same shape (height, width, channels).

    Raises
    ------
    InputError
        If one of them is no array of numbers, or the shapes differ or have no pixels.
    """
    candidate, reference = _numbers("candidate", candidate), _numbers("reference", reference)
    if candidate.shape != reference.shape or candidate.ndim != 3:
        hint = ""
        if candidate.ndim == reference.ndim == 3 and candidate.shape[:2] == reference.shape[:2]:
            hint = "; to compare colours alone, pass picture[..., :3] of both"
        shapes = f"{candidate.shape} and {reference.shape}"
        raise InputError(f"pictures must have one shape (height, width, channels), got {shapes}{hint}")
    if candidate.size == 0:
        raise InputError(f"pictures must have pixels, got shape {candidate.shape}")
    broken = ~(np.isfinite(candidate) & np.isfinite(reference)).all(axis=2)
    with np.errstate(invalid="ignore"):
        difference = np.abs(candidate - reference)
    difference[broken] = np.inf
    row, column = divmod(int(difference.max(axis=2).argmax()), candidate.shape[1])
    return Difference(
        max_error=float(difference.max()),
        rms_error=float(np.sqrt(np.square(difference).mean())),
        mean_error=float(difference.mean()),
        worst_pixel=(column, row),
        non_finite=int(broken.sum()),
    )


def _numbers(name: str, picture: ArrayLike) -> NDArray[np.float64]:
    try:
        return np.asarray(picture, np.float64)
    except (TypeError, ValueError):
        is_file = isinstance(picture, str | os.PathLike)
        found = f"{str(picture)!r}: texvol diff compares files" if is_file else type(picture).__name__
        raise InputError(f"{name} must be an array of numbers, got {found}") from None
