"""Numbers of a projection that come from the parts of a volume, each of which is drawn by itself.

Sums are added, and of extremes the largest or least is kept, in data units and float64: the order of the parts does not
matter, nor that the texels of each stand for values by an offset and a scale of their own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.projection import Sums, ValueProjection
from texvol.textures.value_texture import ValueTexture

Numbers = NDArray[np.float64]
Box = tuple[slice, slice]  # rows and columns of pixels


class CollectedNumbers:
    """Numbers of the rays of a picture of (width, height) pixels, in which nothing has been met yet."""

    def __init__(self, projection: ValueProjection, size: tuple[int, int]) -> None:
        self._projection = projection
        width, height = size
        self._largest = np.full((height, width), -np.inf)  # value times the sign
        self._is_met = np.zeros((height, width), np.bool_)
        self._sums: Sums | None = None
        if not projection.sign_of_largest:
            a, b, c, d = np.zeros((4, height, width))
            self._sums = a, b, c, d

    @property
    def largest(self) -> Numbers:
        """Largest value that each ray has met so far, times `sign_of_largest`; -inf where it has met none."""
        return self._largest

    @property
    def is_met(self) -> NDArray[np.bool_]:
        """True for each ray of mip and minip that has met a value."""
        return self._is_met

    def add(self, where: Box, drawn: NDArray[np.float32], baked: ValueTexture) -> None:
        """Add what the shader has drawn of a part in a box of pixels."""
        with np.errstate(over="ignore"):
            if self._sums is not None:
                for total, part in zip(self._sums, self._projection.sums(drawn, baked), strict=True):
                    total[where] += part
                return
            values, there = self._projection.extremes(drawn, baked)
        largest = self._largest[where]
        np.maximum(largest, self._projection.sign_of_largest * values, out=largest, where=there)
        self._is_met[where] |= there

    def picture(self, slab_thickness: float) -> NDArray[np.float32]:
        """Return the picture, shape (height, width, 4)."""
        if self._sums is not None:
            return self._projection.picture(*self._projection.of_sums(self._sums), slab_thickness)
        values = self._projection.sign_of_largest * self._largest
        return self._projection.picture(values, self._is_met, slab_thickness)
