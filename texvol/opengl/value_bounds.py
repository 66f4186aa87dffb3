"""Bounds of values on the device: a ray in mode mip or minip skips the cells that cannot raise what it has met."""

from __future__ import annotations

import weakref
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume
from texvol.slicing.bounds import bounds_of, side_of, with_large_cells
from texvol.textures.value_storage import stored_values
from texvol.textures.value_texture import ValueTexture
from texvol.util.statistics import on_steps

# Of a stored value: interpolation of equal texels may be so far off. Bounds are lower by as much, so that a ray does
# not look for what is larger than it has met by rounding alone.
_SAME = np.float32(2.0**-22)
_NOTHING = np.float32(-3e38)  # bound of a cell in which all values are missing


class ValueBounds:
    """Texture of the bounds of the last volume; methods need the context to be current."""

    def __init__(self, gl: moderngl.Context) -> None:
        self._gl = gl
        self._of: tuple[Any, ...] = ()
        self._volume: weakref.ref[Volume] | None = None
        self._texture: moderngl.Texture3D | None = None
        self._uniforms: dict[str, Any] = {}

    def prepare(self, baked: ValueTexture, sign: float) -> None:
        """Find the bounds of the stored values times `sign`, 1 or -1; what is known already is kept."""
        of = (baked.storage, sign)
        if self._of == of and self._volume is not None and self._volume() is baked.volume:
            return
        self.release()
        side = side_of(baked.volume)
        # fmax and fmin take of NaN and a number the number.
        extremes = bounds_of(baked.volume.values, side, np.fmax if sign > 0 else np.fmin)
        stored = np.float32(sign) * _stored(extremes, baked)
        bounds = np.where(np.isnan(extremes), _NOTHING, stored - _SAME * np.abs(stored))
        levels = with_large_cells(bounds, np.fmax, float(_NOTHING))
        nz, ny, nx = levels.shape
        self._texture = self._gl.texture3d((nx, ny, nz), 1, np.ascontiguousarray(levels), dtype="f4")
        self._texture.filter = moderngl.NEAREST, moderngl.NEAREST
        numbers = {"cell_side": side, "first_large": len(bounds), "largest_bound": bounds.max()}
        self._uniforms = {name: float(number) for name, number in numbers.items()}
        self._of, self._volume = of, weakref.ref(baked.volume)  # later pictures may do without bounds of this volume

    @property
    def samplers(self) -> dict[str, moderngl.Texture3D]:
        """Textures by the names of their samplers."""
        assert self._texture is not None, "nothing has been prepared"
        return {"bounds": self._texture}

    @property
    def uniforms(self) -> dict[str, Any]:
        """Uniforms of best_cells.glsl."""
        return self._uniforms

    def release(self) -> None:
        """Release the texture and forget the volume."""
        if self._texture is not None:
            self._texture.release()
        self._texture = self._volume = None


def _stored(values: NDArray, baked: ValueTexture) -> NDArray[np.float32]:
    """Return values as a fetch gives them."""
    storage = baked.storage
    if storage.texel_format not in ("r8", "r16"):
        return stored_values(values, storage).astype(np.float32)
    exact = values.astype(np.float64)
    return storage.stored(exact if baked.steps is None else on_steps(exact, *baked.steps)).astype(np.float32)
