"""Mitsuba 3 as a referee: delta tracking, which has no bias, and noise.

Its media emit nothing, and classify before they interpolate. So a medium of ours looks Mitsuba's interpolated value up
in Mitsuba's textures, and a loop of ours takes the colour where the ray of a pixel's middle has its first real
collision: its expectation is the integral of colour times extinction times transmittance. Tracking by the majorant,
interpolation and random numbers are Mitsuba's.
"""

from __future__ import annotations

import itertools
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from side_given import Array, Given, Medium

mi.set_variant("llvm_ad_rgb")

_MOST_AT_ONCE = 1 << 22  # rays, for the memory


class Classified(mi.Medium):
    """Values of a grid, classified after they are interpolated."""

    def __init__(self, values: mi.Volume, medium: Medium) -> None:
        super().__init__(mi.Properties("classified"))
        self._values, self._low, self._most = values, medium.low, float(medium.extinctions.max())
        entries = len(medium.extinctions)
        self._scale, self._offset = (entries - 1) / entries / (medium.high - medium.low), 0.5 / entries
        self._colors, self._extinctions = _table(medium.colors), _table(medium.extinctions[:, np.newaxis])

    def intersect_aabb(self, ray: Any) -> Any:
        """Return where a ray meets the box."""
        return self._values.bbox().ray_intersect(ray)

    def get_majorant(self, at: Any, active: Any = True) -> Any:
        """Return the largest extinction."""
        return mi.Color3f(self._most)

    def get_scattering_coefficients(self, at: Any, active: Any = True) -> Any:
        """Return coefficients of scattering (none), of null collisions, and extinction."""
        extinction = mi.Color3f(self._extinctions.eval(self._place(at, active), active)[0])
        return mi.Color3f(0), self._most - extinction, extinction

    def color(self, at: Any, active: Any) -> Any:
        """Return the colour at a point."""
        return mi.Color3f(*self._colors.eval(self._place(at, active), active))

    def _place(self, at: Any, active: Any) -> Any:
        return mi.Float((self._values.eval_1(at, active) - self._low) * self._scale + self._offset)


def _table(entries: Array) -> Any:
    texels = mi.TensorXf(np.ascontiguousarray(entries, np.float32))
    return mi.Texture1f(texels, filter_mode=dr.FilterMode.Linear, wrap_mode=dr.WrapMode.Clamp)


@dr.syntax
def first_collisions(medium: Any, sampler: Any, ray: Any) -> Any:
    """Return colour and opacity, 0 or 1, of one walk along each ray."""
    color, opacity, active = mi.Color3f(0), mi.Float(0), mi.Bool(True)
    while active:
        at = medium.sample_interaction(ray, sampler.next_1d(active), mi.UInt32(0), active)
        active &= at.is_valid()
        real = active & (sampler.next_1d(active) * at.combined_extinction[0] < at.sigma_t[0])
        color[real] = medium.color(at, real)
        opacity[real] = 1
        active &= ~real
        ray.o[active] = at.p
    return color, opacity


class Program:
    """Grid and rays; every picture has other random numbers."""

    def __init__(self, given: Given) -> None:
        self._size, self._seeds = given.size, itertools.count(1)
        self._rays = np.ascontiguousarray(given.rays.reshape(2, -1, 3).transpose(0, 2, 1), np.float32)
        to_world = mi.ScalarTransform4f().scale(given.box.tolist())
        self._values = mi.load_dict(
            {
                "type": "gridvolume",
                "grid": mi.VolumeGrid(np.ascontiguousarray(given.values[..., np.newaxis], np.float32)),
                "to_world": to_world,
                "filter_type": "trilinear",
                "wrap_mode": "clamp",
                "raw": True,
            }
        )

    def classify(self, medium: Medium) -> None:
        """Take another transfer function."""
        self._medium = Classified(self._values, medium)

    def draw(self, family: str, rate: float) -> NDArray[np.float32]:
        """Return the mean of so many walks of each pixel."""
        width, height = self._size
        pixels, walks = width * height, int(rate)
        at_once = max(min(walks, _MOST_AT_ONCE // pixels), 1)
        total, done = np.zeros((4, pixels)), 0
        while done < walks:
            count = min(at_once, walks - done)
            total += self._summed(count)
            done += count
        return np.float32(total / walks).reshape(4, height, width).transpose(1, 2, 0)

    def _summed(self, walks: int) -> Array:
        pixels = self._rays.shape[2]
        index = dr.arange(mi.UInt32, pixels * walks) % pixels
        origins, directions = (mi.Point3f(*(dr.gather(mi.Float, mi.Float(each), index) for each in part))
                               for part in self._rays)  # fmt: skip
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(next(self._seeds), pixels * walks)
        color, opacity = first_collisions(self._medium, sampler, mi.Ray3f(origins, mi.Vector3f(directions)))
        return np.array([_per_pixel(each, index, pixels) for each in (*color, opacity)])


def _per_pixel(samples: Any, index: Any, pixels: int) -> Array:
    sums = dr.zeros(mi.Float, pixels)
    dr.scatter_reduce(dr.ReduceOp.Add, sums, samples, index)
    return sums.numpy()
