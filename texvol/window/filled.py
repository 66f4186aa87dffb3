"""Part of a picture that shows something: beside it, the picture has the colour of its background.

A software driver needs some nanoseconds for each pixel that it interpolates, and hardly any time to fill a rectangle
with one colour. Most pictures of a large window show their background in half of it.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

_STRIPS = 24  # more would hug the shape closer by a few hundredths of the picture
_MARGIN = 1  # texels: a pixel that is interpolated depends on texels up to half a texel beside it


def filled_part(pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return rectangles that hold all that a picture shows, from 0 to 1, shape (n, 4): left, top, right, bottom.

    They lie one below the other. Beside them the picture, interpolated at any size, has the colour of its first pixel.
    """
    height, width, components = pixels.shape
    differs = pixels.reshape(height, -1) != np.tile(pixels[0, 0], width)
    ends = np.unique(np.linspace(0, height, min(_STRIPS, height) + 1).astype(int))
    found = []
    for top, bottom in pairwise(ends.tolist()):
        near = differs[max(top - _MARGIN, 0) : bottom + _MARGIN].any(axis=0)
        columns = np.flatnonzero(near) // components
        if columns.size:
            left, right = max(columns[0] - _MARGIN, 0), min(columns[-1] + 1 + _MARGIN, width)
            found.append((left / width, top / height, right / width, bottom / height))
    return np.array(found, np.float32).reshape(-1, 4)
