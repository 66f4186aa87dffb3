"""Numbers of a projection that come from the parts of a volume, each of which is drawn by itself.

Sums are added, and of extremes the largest or least is kept, in data units and float64: the order of the parts does not
matter, nor that the texels of each stand for values by an offset and a scale of their own.
"""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.opengl.drawing import AnyTexture
from texvol.opengl.projection import NOTHING_YET, Sums, ValueProjection
from texvol.textures.value_storage import HUGE
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

    def stored_largest(self, where: Box, baked: ValueTexture) -> NDArray[np.float32]:
        """Return what the rays of a box of pixels have met, as a part stores values, for the shader extreme_value."""
        offset, scale = self._projection.sign_of_largest * baked.storage.offset, baked.storage.scale
        with np.errstate(over="ignore"):
            stored = np.clip((self._largest[where] - offset) / scale, -HUGE, HUGE)
        return np.where(self._is_met[where], stored, NOTHING_YET).astype(np.float32)

    def picture(self, slab_thickness: float) -> NDArray[np.float32]:
        """Return the picture, shape (height, width, 4)."""
        if self._sums is not None:
            return self._projection.picture(*self._projection.of_sums(self._sums), slab_thickness)
        values = self._projection.sign_of_largest * self._largest
        return self._projection.picture(values, self._is_met, slab_thickness)


class KnownLargest:
    """Texture of what the rays of pictures have met; methods need the context to be current."""

    def __init__(self, gl: moderngl.Context) -> None:
        self._gl = gl
        self._texture: moderngl.Texture | None = None

    def samplers(self, size: tuple[int, int], where: Box, stored: NDArray[np.float32]) -> dict[str, AnyTexture]:
        """Return the texture of a picture of (width, height) pixels by the name of its sampler.

        `stored` are the numbers in a box of pixels, top row first; elsewhere it then means nothing.
        """
        if self._texture is None or self._texture.size != size:
            self.release()
            self._texture = self._gl.texture(size, 1, dtype="f4")
        rows, columns = stored.shape
        place = where[1].start, size[1] - where[0].stop, columns, rows
        self._texture.write(np.ascontiguousarray(stored[::-1]), viewport=place, alignment=1)
        return {"known": self._texture}

    def release(self) -> None:
        """Release the texture."""
        if self._texture is not None:
            self._texture.release()
        self._texture = None
