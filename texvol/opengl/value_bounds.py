"""Bounds of values on the device: a ray in mode mip or minip skips the cells that cannot raise what it has met."""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume
from texvol.slicing.bounds import Triple, bounds_of, first_place_of, side_of, with_large_cells
from texvol.textures.value_storage import stored_values
from texvol.textures.value_texture import ValueTexture
from texvol.util.statistics import on_steps

# Of a stored value: interpolation of equal texels may be so far off. Bounds are lower by as much, so that a ray does
# not look for what is larger than it has met by rounding alone.
_SAME = np.float32(2.0**-22)
_NOTHING = np.float32(-3e38)  # bound of a cell in which all values are missing


@dataclass(frozen=True)
class Bounds:
    """Bounds of the cells of a volume, as the texture has them, and uniforms of best_cells.glsl."""

    levels: NDArray[np.float32]
    uniforms: dict[str, Any]

    @classmethod
    def of(cls, baked: ValueTexture, sign: float, first: Triple = (0, 0, 0)) -> Bounds:
        """Return the bounds of the stored values times `sign`, 1 or -1; no context is needed.

        The volume may be a part of another one, of whose samples its first is number `first` along x, y, z.
        """
        side = side_of(baked.volume)
        place = first_place_of(first, side)
        x, y, z = (at - start for at, start in zip(first, place, strict=True))
        # fmax and fmin take of NaN and a number the number.
        extremes = bounds_of(baked.volume.values, side, np.fmax if sign > 0 else np.fmin, (z, y, x))
        stored = np.float32(sign) * _stored(extremes, baked)
        bounds = np.where(np.isnan(extremes), _NOTHING, stored - _SAME * np.abs(stored))
        levels = with_large_cells(bounds, np.fmax, float(_NOTHING))
        numbers = {"cell_side": side, "first_large": len(bounds), "largest_bound": bounds.max()}
        ends = np.array([x, y, z]) + baked.volume.dimensions - 1
        places = {"first_place": tuple(map(float, place)), "last_place": tuple(map(float, ends))}
        return cls(levels, {name: float(number) for name, number in numbers.items()} | places)


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
        self.upload(Bounds.of(baked, sign))
        self._of, self._volume = of, weakref.ref(baked.volume)  # later pictures may do without bounds of this volume

    def upload(self, bounds: Bounds) -> None:
        """Make the texture of bounds that have been found."""
        self.release()
        nz, ny, nx = bounds.levels.shape
        self._texture = self._gl.texture3d((nx, ny, nz), 1, np.ascontiguousarray(bounds.levels), dtype="f4")
        self._texture.filter = moderngl.NEAREST, moderngl.NEAREST
        self._uniforms = bounds.uniforms

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
