"""Slices of a volume as pictures: grey by window and level, laid out in tiles.

Their orientation is that of `texvol.scene.slice_axes`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.slice_axes import NAMES, Slice, letters_of, slices_of, typical_window

__all__ = ["NAMES", "Slice", "Tile", "grey", "letters_of", "slices_of", "tiled", "typical_window"]


class Tile(NamedTuple):
    """Rectangle of a picture: upper left corner, size, and number of pictures in the first row."""

    x: float
    y: float
    width: float
    height: float
    columns: int


def tiled(extents: Sequence[tuple[float, float]], width: float, height: float, gap: float) -> list[Tile]:
    """Return the tiles of pictures at one scale, in the number of columns that makes them largest.

    `extents` are the pictures' sizes in world units; tiles are centred and begin at the top. With an infinite height,
    all pictures stand in one column of the full width.
    """
    best: tuple[float, list[list[int]]] = (0.0, [])
    counts = range(1, len(extents) + 1) if np.isfinite(height) else (1,)
    for columns in counts:
        rows = [list(range(len(extents))[first : first + columns]) for first in range(0, len(extents), columns)]
        widest = min((width - gap * (len(row) - 1)) / sum(extents[each][0] for each in row) for row in rows)
        tall = sum(max(extents[each][1] for each in row) for row in rows)
        scale = min(widest, (height - gap * (len(rows) - 1)) / tall)
        if scale > best[0]:
            best = scale, rows
    scale, rows = best
    found, y = [], 0.0
    for row in rows:
        x = (width - scale * sum(extents[each][0] for each in row) - gap * (len(row) - 1)) / 2
        for each in row:
            wide, tall = (max(scale * length, 1.0) for length in extents[each])
            found.append(Tile(x, y, wide, tall, len(rows[0])))
            x += wide + gap
        y += scale * max(extents[each][1] for each in row) + gap
    return found


def grey(values: NDArray, window: tuple[float, float]) -> NDArray[np.uint8]:
    """Return the grey levels of values in a window (centre, width), uint8; NaN is black."""
    centre, width = window
    # Of small integers single precision has all digits, and takes half the time.
    numbers = values.astype(np.result_type(values.dtype, np.float32))
    with np.errstate(over="ignore", invalid="ignore"):
        numbers -= numbers.dtype.type(centre)
        numbers /= numbers.dtype.type(max(width, 1e-30))
    numbers += numbers.dtype.type(0.5)
    np.clip(np.nan_to_num(numbers, copy=False, nan=0.0), 0, 1, out=numbers)
    numbers *= 255
    return np.rint(numbers, out=numbers).astype(np.uint8)
