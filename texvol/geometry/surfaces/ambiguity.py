"""Cells in which signs at the corners do not decide how the surface goes (Dürst 1988)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.geometry.surfaces.field import Field, over_corners


def ambiguous_cells(field: Field) -> NDArray[np.bool_]:
    """Return the mask (nz - 1, ny - 1, nx - 1) of cells with a face whose corners above lie across from each other.

    Only faces count: that two corners across the whole cell may be joined by a tube is not looked for. A cell with a
    missing corner has no surface, and is not ambiguous.
    """
    inner = (slice(1, -1),) * 3
    inside = field.decided[inner] > 0
    found = np.zeros([max(count - 1, 0) for count in inside.shape], np.bool_)
    if not found.size:
        return found
    for axis in range(3):
        samples, cells = np.moveaxis(inside, axis, 0), np.moveaxis(found, axis, 0)
        a, b, c, d = samples[:, :-1, :-1], samples[:, :-1, 1:], samples[:, 1:, :-1], samples[:, 1:, 1:]
        faces = (a == d) & (b == c) & (a != b)
        cells |= faces[1:] | faces[:-1]
    if field.missing is not None:
        found &= ~over_corners(np.logical_or, field.missing[inner])
    return found
