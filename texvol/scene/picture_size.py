"""Size of a picture, checked."""

from __future__ import annotations

import operator

from texvol.util.errors import InputError


def checked_size(size: tuple[int, int]) -> tuple[int, int]:
    """Return (width, height) as integers, or raise InputError unless both are whole numbers of at least 1."""
    try:
        width, height = (operator.index(side) for side in size)
    except (TypeError, ValueError):
        raise InputError(f"size must be (width, height) in whole pixels, got {size!r}") from None
    if min(width, height) < 1:
        raise InputError(f"size must be at least one pixel along each side, got {width}x{height}")
    return width, height
