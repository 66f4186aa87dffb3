"""Size of a picture, checked."""

from __future__ import annotations

import operator
from collections.abc import Sequence

from texvol.util.errors import InputError

AnySize = Sequence[int] | int


def checked_size(size: AnySize) -> tuple[int, int]:
    """Return (width, height) of a pair of whole numbers, or of the side of a square.

    Raises
    ------
    InputError
        If they are not whole numbers of at least 1.
    """
    try:
        sides = (size, size) if hasattr(size, "__index__") and not hasattr(size, "__len__") else size
        width, height = (operator.index(side) for side in sides)  # type: ignore[union-attr]
    except (TypeError, ValueError):
        raise InputError(f"size must be (width, height) or one number, in whole pixels, got {size!r}") from None
    if isinstance(size, bool) or min(width, height) < 1:
        raise InputError(f"size must be at least one pixel along each side, got {width}x{height}")
    return width, height


def shrunk(size: tuple[int, int], longest: float) -> tuple[int, int]:
    """Return a size of the same shape whose sides have at most `longest` pixels; the size itself if they have."""
    factor = min(1.0, longest / max(size))
    return max(1, round(factor * size[0])), max(1, round(factor * size[1]))
