"""Regions: boxes of samples that a large volume is read and drawn in, each at a level of its own.

All regions are of one grid, so that they can be ordered front to back, and each becomes a `Brick`: it owns the slabs
whose middles lie in it, whatever level its texture is of.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.large_volume import LargeVolume, Level
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick, Triple
from texvol.util.errors import InputError

# Samples along x, y, z: small enough to skip what is empty, to tell levels apart, and to be hidden. Each region takes
# some milliseconds of its own, and samples lie side by side along x: half as many are a sixth quicker for 512³ samples.
_SIDES = (256, 128, 128)
_LEAST_PARTS = 32  # that memory has room for
_FEW, _SMALL = 27, 32  # regions, and samples along an axis: fewer regions than these are cut smaller
_LEAST_SIDE = 16  # samples, where memory has no room for more
_MANY = 512  # regions: beyond it they grow, as far as memory goes
_MOST = 1 << 20  # regions, some 10 TB of bytes: listing more takes more memory than they save


@dataclass(frozen=True)
class Region:
    """Samples first … last - 1 of level 0 along x, y, z, at a position in the grid of regions."""

    position: Triple
    first: Triple
    last: Triple

    def is_in(self, block: NDArray[np.float64], dimensions: Triple) -> bool:
        """True if its middle lies in a block, low and high corner in fractions of the box, shape (2, 3)."""
        middle = self.box(dimensions).mean(axis=0)
        return bool((block[0] <= middle).all() and (middle < block[1]).all())

    def box(self, dimensions: Triple) -> NDArray[np.float64]:
        """Low and high corner in fractions of the box of all samples, shape (2, 3)."""
        return np.array([self.first, self.last]) / np.array(dimensions)


def regions_of_level(volume: LargeVolume, number: int) -> list[Region]:
    """Return the regions that a volume is drawn in if no part of it is drawn from a finer level."""
    steps = [max(round(each), 1) for each in volume.levels[number].factor]
    nx, ny, nz = (-(-count // step) for count, step in zip(volume.dimensions, steps, strict=True))
    cut = regions_of((nx, ny, nz), most_samples_of(volume), few_of_level(number))
    ends = [(each.position, each.first, each.last) for each in cut]
    return [
        Region(
            position,
            _triple(np.multiply(first, steps)),
            _triple(np.minimum(np.multiply(last, steps), volume.dimensions)),
        )
        for position, first, last in ends
    ]


def few_of_level(number: int) -> int:
    """Return the number of regions of a level below which they are cut smaller.

    A few samples of a coarse level are read and drawn in less time than regions of them take.
    """
    return _FEW if number == 0 else 1


def regions_of(dimensions: Triple, most_samples: float, few: int = _FEW) -> list[Region]:
    """Return boxes of the samples of some dimensions, at most so many samples each if their sides allow.

    If there are less than `few` of them they are cut smaller.

    Raises
    ------
    InputError
        If there would be too many of them.
    """
    side = [min(most, 1 << (count - 1).bit_length()) for most, count in zip(_SIDES, dimensions, strict=True)]
    while _count(dimensions, side) < few and max(side) > _SMALL:
        side = [min(n, max(side) // 2) for n in side]
    while math.prod(side) > most_samples and max(side) > _LEAST_SIDE:
        side[side.index(max(side))] //= 2
    while _count(dimensions, side) > _MANY:
        axis = min(range(3), key=lambda a: (side[a] >= dimensions[a], side[a]))
        if side[axis] >= dimensions[axis] or 2 * math.prod(side) > most_samples:
            break
        side[axis] *= 2
    if (count := _count(dimensions, side)) > _MOST:
        sizes = " x ".join(map(str, dimensions))
        raise InputError(
            f"volume must be drawn in at most {_MOST} regions, got {sizes} samples, which are {count}: choose a "
            "coarser level by --level, or allow more by --memory"
        )
    axes = [
        [(at // n, at, min(at + n, count)) for at in range(0, count, n)]
        for n, count in zip(side, dimensions, strict=True)
    ]
    return [
        Region((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]))
        for z in axes[2]
        for y in axes[1]
        for x in axes[0]
    ]


def most_samples_of(volume: LargeVolume) -> float:
    """Return how many samples a region may have so that memory has room for many."""
    memory = volume.memory if volume.cut_for is None else volume.cut_for
    return min(memory / _LEAST_PARTS / volume.dtype.itemsize, 1 << 24)


def brick_of(
    region: Region,
    level: Level,
    number: int,
    dimensions: Triple,
    margin: NDArray[np.float64],
    shown: NDArray[np.float64] | None = None,
    goes_on: bool = False,
) -> Brick:
    """Return a region as a brick whose texture is of a level.

    Parameters
    ----------
    level : Level
    number : int
        Of the level.
    dimensions : (nx, ny, nz)
        Of level 0.
    margin : array of shape (3,)
        What is needed beyond the region and the next samples, in samples of level 0 along x, y, z. Of a coarse level
        nothing is, unless it `goes_on`: its samples beyond the region are means of what other regions show.
    shown : array of shape (2, 3), optional
        First sample, along x, y, z, and the one behind the last that is needed for what the region shows.
    goes_on : bool
        True if a coarse level is interpolated across the region's faces, too.
    """
    factor, offset = np.array(level.factor), np.array(level.first)
    low = (np.array(region.first) - 0.5 - offset) / factor
    high = (np.array(region.last) - 0.5 - offset) / factor
    count = np.array(level.source.shape[::-1])
    is_cut = number > 0 and not goes_on
    if is_cut:
        first, last = np.floor(low + 0.75), np.floor(high + 0.75)
    else:
        first, last = np.floor(low - margin / factor), np.floor(high + margin / factor) + 2
    size = np.minimum(last - first, count)  # that of many bricks, whose textures may follow each other
    if shown is not None:
        first, last = np.maximum(first, shown[0]), np.minimum(last, shown[1])
    first = np.clip(first, 0, count - 1).astype(int)
    last = np.clip(last, first + 1, count).astype(int)
    return Brick(
        region.position,
        region.first,
        region.last,
        _triple(first),
        _triple(last),
        dimensions,
        _triple(last - first if is_cut else np.maximum(size, last - first).astype(int)),
        number,
        level.factor,
        level.first,
    )


def margin_of(volume: Volume, camera: Camera, size: tuple[int, int], slab_thickness: float, reach: int) -> NDArray:
    """Samples along x, y, z that a region needs beyond itself: half a slab, and the reach of gradients.

    Half a slab is rounded up to a power of two, so that pictures of similar slabs have the same textures.
    """
    longest = 0.5 * slab_thickness * camera.largest_obliquity(size)
    half = np.clip(np.linalg.norm(volume.index_from_world, axis=1) * longest, 1.0, 1e9)
    return np.exp2(np.ceil(np.log2(half))) + reach


def _count(dimensions: Triple, side: list[int]) -> int:
    return math.prod(-(-count // n) for count, n in zip(dimensions, side, strict=True))


def _triple(numbers: NDArray[np.intp]) -> Triple:
    x, y, z = (int(number) for number in numbers)
    return x, y, z
