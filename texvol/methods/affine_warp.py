"""Resampling of a picture at affine positions, bilinearly."""

from __future__ import annotations

import numpy as np

from texvol.ray_casting.common.compiling import compiled_and_cached


@compiled_and_cached
def resample(source, maps, row, picture):  # type: ignore[no-untyped-def]
    """Fill rows of a picture from `row` on; beside the source there is nothing.

    `maps` (2, 3) takes column, row and 1 of the picture to column and row of the source.
    """
    rows, columns = source.shape[:2]
    for v in range(picture.shape[0]):
        for u in range(picture.shape[1]):
            x = maps[0, 0] * u + maps[0, 1] * (v + row) + maps[0, 2]
            y = maps[1, 0] * u + maps[1, 1] * (v + row) + maps[1, 2]
            i, j = int(np.floor(x)), int(np.floor(y))
            picture[v, u] = 0.0
            for corner in range(4):
                a, b = i + corner % 2, j + corner // 2
                if 0 <= a < columns and 0 <= b < rows:
                    weight = (1 - abs(x - a)) * (1 - abs(y - b))
                    for channel in range(4):
                        picture[v, u, channel] += weight * source[b, a, channel]
