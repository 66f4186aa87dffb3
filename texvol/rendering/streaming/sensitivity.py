"""Prediction of how far coarse levels of regions move a picture, by rays through a guide.

A ray meets intervals of length h, with opacities a and colours C of which the mean is known. It shows

    I = Σ T_i C_i + T_n · background,    T_i = Π_{j<i} (1 - a_j)

and if an interval is not what it seemed, with B_i what is seen behind it, I moves by T_i (δC_i - δa_i B_i). The values
in an interval are normal with the variance that a level leaves out: that is the variance of C_i - a_i B_i. Intervals of
a coarse sample are off together and others as they like, so along its way through a region a ray moves by

    V = Σ E[T_i²] Var(C_i - a_i B_i) l / h + β² (Σ √(E[T_i²] Var(C_i - a_i B_i)))²

where l is the length of a coarse sample, and E[T_i²] = Π_{j<i} (1 - 2 E[a_j] + E[a_j²]): what hides an interval may be
there or not. The second term is for what all intervals have in common, if values are distributed otherwise. Regions are
independent of each other. The picture moves by at most z √(Σ V).

Rays pass beside the worst places. So each interval has the largest variance, and the largest (1 - a)², of the guide's
sample that it lies in and those around. z and β were chosen by pictures of eight real volumes of which one region or
all is of a coarse level, and then by random scenes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.streaming.left_out import Floats, Guide, Numbers, most_around
from texvol.rendering.visible_rays import visible_rays
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene
from texvol.slicing.coverage import pixel_boxes_of
from texvol.slicing.regions import Region
from texvol.textures.distribution import NODES, ROWS

Size = tuple[int, int]
_RAYS = 48 * 48
MOST_DEVIATIONS = 3.0  # z
_IN_COMMON = 0.4  # β
_FEW = 16  # rays
_MOST_PIXELS = 1 << 20  # of a picture of which the rays are some
_MOST_INTERVALS = 512  # on a ray


@dataclass(frozen=True)
class Intervals:
    """Intervals on rays that meet the box, shape (rays, intervals): samples of a guide, and regions they lie in."""

    length: float  # world units
    samples: NDArray[np.intp]  # in the flattened guide
    regions: NDArray[np.intp]  # -1: of none, or outside of the box


class Sensitivity:
    """How far regions of coarse levels move the picture of each ray."""

    def __init__(self, scene: CompleteScene, size: Size, guide: Guide, regions: Sequence[Region]) -> None:
        self._scene, self._guide, self._count = scene, guide, len(regions)
        self._on_rays = _intervals(scene, size, guide, regions)

    @property
    def missed(self) -> NDArray[np.bool_]:
        """Regions that hardly any ray meets: of slivers and what is at the picture's edge too little is known."""
        inside = self._on_rays.regions
        return np.array([(inside == number).any(axis=1).sum() < _FEW for number in range(self._count)], np.bool_)

    def variance(self, number: int) -> Floats:
        """Return V for a level of every region, shape (rays, regions)."""
        on_rays, level = self._on_rays, self._guide.volume.levels[number]
        each = self._variances(number)
        length = float((self._guide.volume.spacing * level.factor).max())
        rays = np.broadcast_to(np.arange(len(on_rays.samples))[:, np.newaxis], on_rays.samples.shape)
        inside = on_rays.regions >= 0
        where = rays[inside] * self._count + on_rays.regions[inside]
        total = len(on_rays.samples) * self._count
        alone = np.bincount(where, each[inside] * (length / on_rays.length), total)
        together = np.bincount(where, np.sqrt(each[inside]), total)
        return (alone + (_IN_COMMON * together) ** 2).reshape(-1, self._count).astype(np.float32)

    def _variances(self, number: int) -> Numbers:
        """T² Var(C - a B) of each interval, the largest of all channels, if all are of one level."""
        moments = self._moments
        at = self._places(most_around(self._guide.left_out(number)))
        front, behind = self._front_and_behind
        found = np.zeros(at.shape)
        opacity, opacity_2 = (np.take(moments[..., k].reshape(-1), at) for k in (3, 10))
        of_opacity = np.maximum(opacity_2 - opacity**2, 0)
        for channel in range(3):
            color, color_2, product = (
                np.take(moments[..., k].reshape(-1), at) for k in (channel, 4 + channel, 7 + channel)
            )
            b = behind[..., channel]
            one = color_2 - color**2 - 2 * b * (product - color * opacity) + b**2 * of_opacity
            found = np.maximum(found, one)
        found = np.maximum(found, (1 - behind[..., 3]) ** 2 * of_opacity)
        light = self._scene.lighting
        if light is not None:
            # Normals of coarse samples are others: shades are taken to lie anywhere from none to the brightest.
            found = max(light.brightest, 1.0) ** 2 * (found + opacity**2 / 12)
        return np.asarray(front * found)

    @cached_property
    def _front_and_behind(self) -> tuple[Numbers, Numbers]:
        """Mean square of the transmittance in front of each interval, and colour and opacity of what is behind."""
        at = self._places(self._guide.below)
        mean = np.stack([np.take(self._moments[..., k].reshape(-1), at) for k in range(4)], axis=-1)
        outside = self._on_rays.regions < 0
        mean[outside] = 0
        behind = np.empty(mean.shape)
        now = np.broadcast_to(np.array([*self._scene.background, 0.0]), (len(at), 4))
        for i in range(at.shape[1] - 1, -1, -1):
            behind[:, i] = now
            now = mean[:, i] + (1 - mean[:, i, 3:]) * now
        through = np.cumprod(np.where(outside, 1.0, self._clearest), axis=1)
        return np.concatenate([np.ones((len(at), 1)), through[:, :-1]], axis=1), behind

    @cached_property
    def _clearest(self) -> Numbers:
        """Mean square of the transmittance of each interval, or of one beside it that lets more through."""
        guide = self._guide
        at = self._places_of(guide.means, guide.below)
        opacity, of_square = (np.take(self._moments[..., k].reshape(-1), at) for k in (3, 10))
        most = most_around(np.maximum(1 - 2 * opacity + of_square, 0).astype(np.float32))
        return np.asarray(most.reshape(-1)[self._on_rays.samples], np.float64)

    def _places(self, variances: Floats) -> NDArray[np.intp]:
        """Return where in the tables the distributions are that intervals have."""
        samples = self._on_rays.samples
        return self._places_of(self._guide.means.reshape(-1)[samples], variances.reshape(-1)[samples])

    def _places_of(self, means: Floats, variances: Floats) -> NDArray[np.intp]:
        """Return where in the tables some distributions are."""
        function = self._guide.function
        low, high = function.ends
        column = np.rint(means * ((NODES - 1) * function.range / (high - low))).astype(np.intp)
        row = np.rint(function.row_of(variances)).astype(np.intp)
        return np.minimum(row, ROWS - 1) * NODES + column

    @cached_property
    def _moments(self) -> Floats:
        """Means of C, a, C², C a and a² in an interval, shape (ROWS, NODES, 11)."""
        function = self._guide.function
        medium = function.medium
        depth = medium[:, 3:] * self._on_rays.length
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = np.where(depth > 1e-8, -np.expm1(-depth) / depth, 1.0)
        color, opacity = medium[:, :3] * mean * self._on_rays.length, -np.expm1(-depth)
        return function.smoothed(np.column_stack([color, opacity, color**2, color * opacity, opacity**2]))


def _intervals(scene: CompleteScene, size: Size, guide: Guide, regions: Sequence[Region]) -> Intervals:
    volume, samples = guide.volume, guide.samples
    rays = visible_rays(scene, *_rays(scene, size, volume))
    nearest, directions, first, last = (each[rays.last > rays.first] for each in rays)
    longest = float((last - first).max(initial=0.0))
    length = max(float(samples.spacing.min()), longest / _MOST_INTERVALS)
    middles = first[:, np.newaxis] + (np.arange(max(int(np.ceil(longest / length)), 1)) + 0.5) * length
    inside = middles < last[:, np.newaxis]
    places = nearest[:, np.newaxis] + middles[..., np.newaxis] * directions[:, np.newaxis] + volume.centre
    index = _nearest((places - samples.origin) @ samples.index_from_world.T, samples.dimensions)
    nx, ny, _ = samples.dimensions
    flat = (index[..., 2] * ny + index[..., 1]) * nx + index[..., 0]
    at = _nearest((places - volume.origin) @ volume.index_from_world.T, volume.dimensions)
    return Intervals(length, flat, np.where(inside, _owners(at, regions), -1))


def _nearest(index: Numbers, dimensions: tuple[int, int, int]) -> NDArray[np.intp]:
    return np.clip(np.rint(index), 0, np.array(dimensions) - 1).astype(np.intp)


def _owners(at: NDArray[np.intp], regions: Sequence[Region]) -> NDArray[np.intp]:
    """Return the number of the region that each sample is in, -1 for none."""
    cells = []
    for axis in range(3):
        begins = {region.position[axis]: (region.first[axis], region.last[axis]) for region in regions}
        table = np.full(int(at[..., axis].max(initial=0)) + 1, max(begins, default=0) + 1)
        for position, (first, last) in begins.items():
            table[first:last] = position
        cells.append(table[at[..., axis]])
    owners = np.full([max(r.position[a] for r in regions) + 2 for a in range(3)], -1)
    for number, region in enumerate(regions):
        owners[region.position] = number
    x, y, z = cells
    return owners[x, y, z]


def _rays(scene: CompleteScene, size: Size, volume: LargeVolume) -> tuple[Numbers, Numbers]:
    """Return origins and directions of about _RAYS rays, spread over what the picture shows of the box."""
    whole = np.array([[[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]])
    (low,), (high,) = pixel_boxes_of(volume, scene.camera, size, whole)
    covered = float(np.prod(np.maximum(high - low, 1)))
    finer = np.clip(np.sqrt(_RAYS / covered), 0, max(np.sqrt(_MOST_PIXELS / np.prod(size)), 1.0))
    width, height = (max(round(side * finer), 1) for side in size)
    (low,), (high,) = pixel_boxes_of(volume, scene.camera, (width, height), whole)
    eyes, directions = scene.camera.rays((width, height))
    part = slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))
    return eyes[part].reshape(-1, 3), directions[part].reshape(-1, 3)
