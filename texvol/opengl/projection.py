"""Modes in which the values themselves are seen: what the shader projects, and the numbers that come of it.

    xray         ∫ v ds, in data units times world units           average      that, divided by its length
                 or of what is above air, see `air`
    mip, minip   the largest and the least value on the ray         isosurface   the first place of one value, lit

over the ray's path through the box, in front of the eye, where there are values. Pictures of the first four hold the
number in red, green and blue, and 1 in alpha where there is one.

What the error is made of. Between two planes through sample centres the value along a ray is a cubic, which four looks
determine. mip, minip and isosurface go from plane to plane and take the extremes and the first root of the cubic
itself: however thick slabs are, only float32 is left of the error, in which a position is known to some 2^-24 of the
box and the value accordingly: a few millionths of the range. xray and average take the value in the middle of each
slab, clipped to the box: order 2 in the thickness, most of it from the planes, at which the value's slope changes by
up to c and a slab of length h loses up to c h² / 8, and as much where the value passes that of air; the edge of
missing values is known to half a slab. Where there are infinities they go from plane to plane as well, so that none
is stepped over. A surface that a ray touches within that rounding may be met or missed; so may, beside NaN or an
infinity, an interval of less than 10^-5 of the box. Where NaN lies one sample from the border, drivers may make NaN
of what is beyond that sample too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.air import Attenuation, attenuation_of
from texvol.scene.camera import Camera
from texvol.scene.display import isosurface_looks
from texvol.scene.lighting import Lighting
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick
from texvol.textures.value_storage import FAR, HUGE, bulk_of
from texvol.textures.value_texture import ValueTexture

NOTHING_YET = -3e38  # the largest value of none
_ROUNDING = 2.0**-20  # of a value, more than interpolation loses
_SAME = 2.0**-22  # of a stored value: half an ulp or two, which interpolation may take from equal texels
_ALL_FINITE = 3e38
SURFACE_ENDING = 2.0**-22  # transmittance at which a ray ends among isosurfaces, as in shaders/isosurfaces.glsl
_OFTEN_FAR = 16.0  # times the extent of most values: from there on the next cell may show in this one, by rounding
Numbers = NDArray[np.float64]
Sums = tuple[Numbers, Numbers, Numbers, Numbers]
_SEVERAL = 4  # the shader's mode of several isosurfaces
_MODES = {"xray": 1, "average": 1, "mip": 2, "minip": 2, "isosurface": 3}
SIGN_OF_LARGEST = {"mip": 1.0, "minip": -1.0}  # with which values are compared


@dataclass(frozen=True)
class Isovalue:
    """Values that show in mode isosurface, with the interface of a transfer function."""

    values: tuple[float, ...]

    def shows_between(
        self, lowest: ArrayLike, highest: ArrayLike, largest_magnitude: ArrayLike = np.inf
    ) -> NDArray[np.bool_]:
        """True where an isovalue lies between the two, within rounding, at any gradient; False where either is NaN."""
        lowest, highest = np.asarray(lowest, np.float64), np.asarray(highest, np.float64)
        with np.errstate(invalid="ignore", over="ignore"):
            found = np.zeros(np.broadcast_shapes(lowest.shape, highest.shape), np.bool_)
            for value in self.values:
                margin = _ROUNDING * np.maximum(np.maximum(np.abs(lowest), np.abs(highest)), abs(value))
                found |= (lowest - margin <= value) & (value <= highest + margin)
            return found


@dataclass(frozen=True)
class ValueProjection:
    """Projection of the values, for the shader projection.glsl; with `depth`, the depth of the first isosurface.

    `looks` are straight colours and opacities of the isosurfaces, shape (n, 4).
    """

    mode: str
    isovalues: tuple[float, ...]
    looks: NDArray[np.float64]
    lighting: Lighting | None
    depth: bool = False
    attenuation: Attenuation | None = None  # what an X-ray integrates in place of the value

    @property
    def _number(self) -> int:
        """The shader's switch MODE."""
        is_single = len(self.isovalues) < 2 and (self.looks[:, 3] == 1).all()
        return _MODES[self.mode] if is_single else _SEVERAL

    @property
    def sign_of_largest(self) -> float:
        """Sign with which values are compared; 0 where extremes do not matter."""
        return SIGN_OF_LARGEST.get(self.mode, 0.0)

    @property
    def blending(self) -> str:
        """Blending of bricks."""
        return {1: "add", 2: "largest", 3: "under"}[_MODES[self.mode]]

    @property
    def measures_rays(self) -> bool:
        """True if the length of a ray in the box matters."""
        return _MODES[self.mode] == 1

    @property
    def nothing(self) -> tuple[float, float, float, float]:
        """Clear value of the target."""
        return (NOTHING_YET, 0.0, 0.0, 0.0) if _MODES[self.mode] == 2 else (0.0, 0.0, 0.0, 0.0)

    def switches(self, baked: ValueTexture) -> dict[str, int]:
        """Switches of the shader, but for those of light."""
        return {
            "MODE": self._number,
            "ISOVALUES": len(self.isovalues) if self._number == _SEVERAL else 0,
            "DEPTH": int(self.depth),
            "MISSING": self._missing(baked),
            "GRADIENT": baked.gradient_switch,
            "WEIGHTS": 0,  # what a mask hides is missing
        }

    def _may_be_far(self, baked: ValueTexture) -> bool:
        """True if cells may hold values beside which float32 loses those of most samples."""
        return _MODES[self.mode] != 1 and baked.storage.farthest(baked.volume) > _OFTEN_FAR * baked.storage.extent

    def uniforms(self, baked: ValueTexture, brick: Brick) -> dict[str, Any]:
        """Uniforms of the shader, but for those of light and rays; `brick` is what the texture holds of the box."""
        uniforms: dict[str, Any] = {}
        if self._missing(baked):
            uniforms = {"missing_from": baked.missing_from, "largest_finite": _largest_finite(baked)}
        if self._missing(baked) == 2 or not self.measures_rays:
            uniforms["samples"] = tuple(map(float, brick.samples_per_box))
            corner = (brick.samples_before - brick.stored_first) / brick.samples_per_box
            uniforms["first_corner"] = tuple(map(float, corner))
        if self.measures_rays:
            bias = self._bias(baked)
            return uniforms | {"bias": bias, "least": -_ALL_FINITE if self.attenuation is None else bias}
        if self._missing(baked) and self._number != _SEVERAL:
            uniforms["far_from"] = FAR * baked.storage.extent
        if sign := self.sign_of_largest:
            low, high = baked.volume.value_range or (0.0, 0.0)
            end = high if sign > 0 else low
            most = float(np.clip(sign * (end - baked.storage.offset) / baked.storage.scale, -2 * HUGE, _ALL_FINITE))
            return uniforms | {"sign_of_largest": sign, "largest_of_all": most}
        # No value that is stored lies beyond these.
        stored = np.clip((np.array(self.isovalues) - baked.storage.offset) / baked.storage.scale, -2 * HUGE, 2 * HUGE)
        if self._number == _SEVERAL:
            uniforms["isovalues"] = [float(each) for each in stored]
            return (
                uniforms if self.depth else uniforms | {"surface_colors": [tuple(look) for look in self.looks.tolist()]}
            )
        uniforms |= {"isovalue": float(stored[0]), "same": _SAME * float(abs(stored[0]))}
        return uniforms if self.depth else uniforms | {"surface_color": tuple(self.looks[0, :3].tolist())}

    def numbers(self, drawn: NDArray[np.float32], baked: ValueTexture, slab_thickness: float) -> NDArray[np.float32]:
        """The picture, shape (h, w, 4), of what the shader has drawn."""
        if self.mode == "isosurface":
            return drawn
        with np.errstate(over="ignore"):
            found = self.extremes(drawn, baked) if self.sign_of_largest else self.of_sums(self.sums(drawn, baked))
        return self.picture(*found, slab_thickness)

    def picture(self, found: Numbers, there: NDArray[np.bool_], slab_thickness: float) -> NDArray[np.float32]:
        """The picture, shape (h, w, 4), of the number of each ray, as `extremes` and `of_sums` return it."""
        with np.errstate(over="ignore"):  # what single precision has no number for is infinite
            if self.mode == "xray":
                found = found * slab_thickness
            # Whole arrays are copied: picking pixels takes longer than the sums.
            picture = np.empty((*found.shape, 4), np.float32)
            picture[..., :3] = np.where(there, found, 0.0)[..., np.newaxis]
        picture[..., 3] = there
        return picture

    def extremes(self, drawn: NDArray[np.float32], baked: ValueTexture) -> tuple[Numbers, NDArray[np.bool_]]:
        """Largest or least values, and where there are any."""
        red = drawn[..., 0].astype(np.float64)
        stored = red if self.mode == "mip" else -red
        found = np.clip(baked.storage.offset + baked.storage.scale * stored, *(baked.volume.finite_range or (0.0, 0.0)))
        infinite = np.abs(stored) > _largest_finite(baked)
        if infinite.any():
            found[infinite] = np.copysign(np.inf, stored[infinite])
        return found, red > NOTHING_YET / 2

    def sums(self, drawn: NDArray[np.float32], baked: ValueTexture) -> Sums:
        """Integrals of finite values, and lengths on which there is a value, an infinite and a minus infinite one.

        All are along the ray in slab thicknesses, and of shape (h, w). Those of the parts of a volume add up.
        """
        above, length, infinite, minus_infinite = np.moveaxis(drawn.astype(np.float64), -1, 0)
        base, per, finite = baked.storage.offset + baked.storage.scale * self._bias(baked), 1.0, length
        if self.attenuation is not None:
            base, per = max(base - self.attenuation.air, 0.0), self.attenuation.per_value
            # Minus infinity lets all light through, as air does.
            finite, minus_infinite = length - minus_infinite, np.zeros_like(length)
        return per * (baked.storage.scale * above + base * finite), length, infinite, minus_infinite

    def of_sums(self, sums: Sums) -> tuple[Numbers, NDArray[np.bool_]]:
        """Integrals per slab thickness, or averages, and where there are any."""
        found, length, infinite, minus_infinite = sums
        if self.mode == "average":
            found = np.divide(found, length, out=np.zeros_like(found), where=length > 0)
        is_infinite = (infinite > 0) | (minus_infinite > 0)
        if is_infinite.any():
            both = (infinite > 0) & (minus_infinite > 0)  # of which there is no sum
            found = np.where(is_infinite, np.where(both, np.nan, np.where(infinite > 0, np.inf, -np.inf)), found)
        return found, length > 0

    def _missing(self, baked: ValueTexture) -> int:
        """The shader's switch MISSING."""
        if _has_infinities(baked.volume):
            return 2 if self.measures_rays else 1
        return int(baked.volume.has_missing or self._may_be_far(baked))

    def _bias(self, baked: ValueTexture) -> float:
        """The stored value, as single precision has it, that sums are counted from."""
        low, high = baked.volume.finite_range or (0.0, 0.0)
        first, last = bulk_of(baked.volume)
        base = first / 2 + last / 2
        if self.attenuation is not None:
            # Below all values by more than their range there is no number to sum up from.
            base = float(np.clip(self.attenuation.air, 2 * low - high, high))
        return float(np.float32((base - baked.storage.offset) / baked.storage.scale))


def projection_of(scene: Scene, *, depth: bool = False) -> ValueProjection | None:
    """Return the projection of a scene; None in mode composite."""
    if scene.mode == "composite":
        return None
    lighting = (scene.lighting or Lighting()) if scene.mode == "isosurface" and not depth else None
    looks = isosurface_looks(scene)
    return ValueProjection(scene.mode, scene.isovalues, looks, lighting, depth, attenuation_of(scene.air))


def depth_of(drawn: NDArray[np.float32], volume: Volume, camera: Camera, slab_thickness: float) -> NDArray[np.float64]:
    """Depth of the surface from what the shader says of it, shape (h, w): along the view from the eye, world units."""
    middle = float(camera.forward @ (volume.centre - camera.eye))
    return np.where(drawn[..., 3] > 0, middle + drawn[..., 0].astype(np.float64) * slab_thickness, np.inf)


def _has_infinities(volume: Volume) -> bool:
    return volume.value_range != volume.finite_range


def _largest_finite(baked: ValueTexture) -> float:
    """Largest magnitude of the stored finite values."""
    volume = baked.volume
    if not _has_infinities(volume) or volume.finite_range is None:
        return _ALL_FINITE
    return (1 + _ROUNDING) * max(abs((end - baked.storage.offset) / baked.storage.scale) for end in volume.finite_range)
