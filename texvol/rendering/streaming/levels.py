"""Level of each region: as fine as pixels can show, or the coarsest that keeps an error.

*By pixels.* A level is as fine as a region's nearest pixel can show if its samples lie no farther apart than pixels do.

*By error.* Where a region is drawn from a coarse level its medium is the mean one (`texvol.textures.distribution`),
and a ray that passes it at one position meets another. What it meets differs at most by the range of q or τ over the
values in a chunk, on the length h of a coarse sample, if the values differ in a few places only; and if they differ
everywhere, in each of the chunk's n coarse samples on the ray, with either sign,

    moved <= h max(range, slope sqrt(variance n))

with the steepest slope of q or τ over these values. What regions behind each other move is to be at most E: squares add
up. Only what is still seen of a region counts, which is known when it is about to be read.

Real volumes differ from their halved ones by a tenth to a third of their range wherever anything is in them. So an
error of 1/100 is kept by coarse levels where the medium hardly changes, or is hardly seen, and nowhere else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.settings import Settings
from texvol.scene.large_volume import LargeVolume, Level
from texvol.scene.looks import EXPOSED
from texvol.scene.scene import CompleteScene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.slicing.regions import Region
from texvol.util.errors import InputError

_MOST_LIT = 3e7  # samples of a level whose gradients take a second or two
_NODES = 4096  # values at which a transfer function is looked at
Numbers = NDArray[np.float64]


def levels_by_pixels(
    scene: CompleteScene, size: tuple[int, int], settings: Settings, volume: LargeVolume, regions: Sequence[Region]
) -> list[int]:
    """Return the level of each region: that of the settings, or a coarser one if pixels show no more and it may be."""
    levels = [settings.level] * len(regions)
    if settings.coarser_by_pixels:
        apart = [_pixel_distance(scene, size, volume, region) for region in regions]
        levels = [max(settings.level, _level_of(volume, each)) for each in apart]
    return [
        next(number for number in range(level, -1, -1) if number == 0 or covers(volume.levels[number], region))
        for level, region in zip(levels, regions, strict=True)
    ]


@dataclass(frozen=True)
class LevelsAskedFor:
    """Arguments of `Renderer.render` that decide the levels."""

    level: int | str = "auto"
    level_error: float | None = None  # that coarser levels may have; half of `max_error` if None
    max_error: float | None = None  # of the whole picture
    slabs: float | None = None  # not None if the slabs' thickness was asked for
    coarser_by_pixels: bool | None = None  # None: if the level is auto


def with_levels(
    scene: CompleteScene,
    size: tuple[int, int],
    settings: Settings,
    asked: LevelsAskedFor,
) -> Settings:
    """Return the settings with the levels of a large volume, and slabs as thick as these need.

    Raises
    ------
    InputError
        If there is no such level, the scene has no levels, or the error is negative.
    """
    volume, level, level_error = scene.volume, asked.level, asked.level_error
    if level_error is not None and not 0 <= level_error < np.inf:
        raise InputError(f"error of levels must be finite and not negative, got {level_error:g}")
    if not isinstance(volume, LargeVolume):
        if level not in ("auto", 0):
            raise InputError(f"level must be of a volume in a store that is drawn part by part, got {level!r}")
        return settings
    if level_error is None and level == "auto" and asked.max_error is not None:
        level_error = asked.max_error / 2
    if level_error is not None:
        if level not in ("auto", 0):
            raise InputError(f"level must be auto where an error decides it, got {level!r}")
        return replace(settings, level_error=level_error)
    given = asked.slabs is not None and asked.max_error is None
    number = settled_level(scene, size, level, settings.slab_thickness if given else None)
    if level == "auto" and asked.slabs is None:
        number = _sooner(scene, size, volume, number)
    thickness = settings.slab_thickness
    if asked.slabs is None:
        thickness *= float((volume.spacing * volume.levels[number].factor).min()) / volume.smallest_spacing
    coarser = asked.coarser_by_pixels
    if coarser is None and level == "auto":  # slabs are as thick everywhere: if they decide, so are all samples apart
        coarser = number == settled_level(scene, size, level, None)
    thickness = min(thickness, 2 * volume.radius)
    return replace(settings, level=number, coarser_by_pixels=coarser or None, slab_thickness=thickness)


def _sooner(scene: CompleteScene, size: tuple[int, int], volume: LargeVolume, number: int) -> int:
    """Return a level for a first picture: in the light of a look, gradients of all fine samples would take seconds.

    Samples of the level are at most two pixels apart. A scene with a light of its own stays as it is.
    """
    if scene.lighting != EXPOSED or number + 1 >= len(volume.levels):
        return number
    samples = float(np.prod(volume.levels[number].source.shape, dtype=float))
    whole = Region((0, 0, 0), (0, 0, 0), volume.dimensions)
    coarsest = _level_of(volume, 2 * _pixel_distance(scene, size, volume, whole))
    return min(number + 1, max(coarsest, number)) if samples > _MOST_LIT else number


def with_levels_told(
    scene: CompleteScene, size: tuple[int, int], settings: Settings, asked: LevelsAskedFor
) -> Settings:
    """Return `with_levels` of a picture that is drawn now.

    If coarse levels may be in it the command tells at its end which of them lie elsewhere than they say.
    """
    settings = with_levels(scene, size, settings, asked)
    remark_on_coarse_levels(scene.volume, settings)
    return settings


def remark_on_coarse_levels(volume: Volume, settings: Settings) -> None:
    """Let the command tell at its end which levels lie elsewhere than they say, if a picture may have coarse ones."""
    if isinstance(volume, LargeVolume) and (
        settings.level or settings.coarser_by_pixels or settings.level_error is not None or volume.source.get("level")
    ):
        volume.remark_on_levels()


def settled_level(scene: CompleteScene, size: tuple[int, int], level: int | str, most_apart: float | None) -> int:
    """Return the level of the part of the volume that is nearest to the eye.

    Parameters
    ----------
    level : int or "auto"
        That was asked for; "auto": the finest that pixels can show.
    most_apart : float, optional
        Slab thickness that was asked for, world units, which samples are to be no farther apart than.

    Raises
    ------
    InputError
        If there is no such level.
    """
    volume = scene.volume
    assert isinstance(volume, LargeVolume)
    if level == "auto":
        whole = Region((0, 0, 0), (0, 0, 0), volume.dimensions)
        apart = _pixel_distance(scene, size, volume, whole)
        return _level_of(volume, apart if most_apart is None else min(apart, most_apart))
    if isinstance(level, bool) or not isinstance(level, int) or not 0 <= level < len(volume.levels):
        raise InputError(f"level must be auto or from 0 to {len(volume.levels) - 1}, got {level!r}")
    return level


@dataclass(frozen=True)
class PredictedErrors:
    """How far each level of each region would move the picture, shape (regions, levels), and what is allowed."""

    moved: Numbers
    allowed: float

    def level(self, region: int, seen: float) -> int:
        """Return the coarsest level of a region of which at most a fraction `seen` is seen that keeps the error."""
        keep = np.flatnonzero(self.moved[region] * seen <= self.allowed)
        return int(keep.max(initial=0))


def predicted_errors(
    scene: CompleteScene, volume: LargeVolume, regions: Sequence[Region], max_error: float
) -> PredictedErrors | None:
    """Return what coarse levels are predicted to move; None if that is not known: all is drawn from the finest."""
    statistics = volume.levels[0].statistics
    if statistics is None or scene.medium.needs_gradient:  # gradients of coarse samples are not those of fine ones
        return None
    light = max(scene.lighting.brightest, 1.0) if scene.lighting else 1.0
    low, high = (np.nan_to_num(each) for each in (statistics.lowest_around, statistics.highest_around))
    slope, span = _slopes_and_ranges(scene.medium, low, high)
    deviation = np.sqrt(np.nan_to_num(statistics.variance))
    with np.errstate(invalid="ignore"):
        sums = np.where(deviation > 0, np.minimum(slope * deviation, span), 0.0)
    longest = float((np.array(statistics.chunk_shape[::-1]) * volume.spacing).max())
    coarse = [float((volume.spacing * level.factor).max()) for level in volume.levels]
    moved = np.zeros((len(regions), len(volume.levels)))
    for row, region in zip(moved, regions, strict=True):
        chunks = tuple(
            slice(a // n, -(-b // n))
            for a, b, n in zip(region.first[::-1], region.last[::-1], statistics.chunk_shape, strict=True)
        )
        once, everywhere = float(span[chunks].max()), float(sums[chunks].max())
        row[:] = [light * h * max(once, everywhere * np.sqrt(max(longest / h, 1.0))) for h in coarse]
        row[[not covers(level, region) for level in volume.levels]] = np.inf
    moved[:, 0] = 0.0
    behind = max((len({region.position[axis] for region in regions}) for axis in range(3)), default=1)
    return PredictedErrors(moved, max_error / float(np.sqrt(behind)))


def covers(level: Level, region: Region) -> bool:
    """True if the samples of a level fill a region: some pyramids leave the last ones of odd numbers out."""
    count, factor, first = np.array(level.source.shape[::-1]), np.array(level.factor), np.array(level.first)
    begins, ends = first - factor / 2, first + factor * (count - 0.5)
    return bool((begins <= np.array(region.first)).all() and (ends >= np.array(region.last) - 1).all())


def _slopes_and_ranges(function: TransferFunction, low: Numbers, high: Numbers) -> tuple[Numbers, Numbers]:
    """Return the steepest slope and the range of any of q and τ between two values, of the shape of these."""
    values = function.values
    nodes = np.unique(np.concatenate([values, np.linspace(values[0], values[-1], _NODES)]))
    emission, extinction = function.classify(nodes)
    medium = np.column_stack([emission, extinction])
    medium = np.where(np.isinf(medium), 1e30, medium)
    gaps = np.diff(nodes)
    slopes = np.abs(np.diff(medium, axis=0)).max(axis=1) / np.where(gaps > 0, gaps, 1.0)
    steps = np.flatnonzero(np.diff(values) == 0)
    first = np.clip(np.searchsorted(nodes, low, side="right") - 1, 0, len(nodes) - 1)
    last = np.clip(np.searchsorted(nodes, high, side="left"), 0, len(nodes) - 1)
    slope, span = np.zeros(low.shape), np.zeros(low.shape)
    for index in np.ndindex(*low.shape):
        a, b = int(first[index]), int(last[index])
        if b > a:
            slope[index] = slopes[a:b].max()
            span[index] = np.ptp(medium[a : b + 1], axis=0).max()
        if any(low[index] <= values[step] <= high[index] for step in steps):
            slope[index] = np.inf
    return slope, span


def _level_of(volume: LargeVolume, apart: float) -> int:
    """Return the coarsest level whose samples lie no farther apart than so many world units."""
    fitting = [
        n for n, level in enumerate(volume.levels) if (volume.spacing * level.factor).max() <= apart * (1 + 1e-9)
    ]
    return max(fitting, default=0)


def _pixel_distance(scene: CompleteScene, size: tuple[int, int], volume: LargeVolume, region: Region) -> float:
    """Return how far pixels are apart where a region is nearest, world units; 0 at the eye."""
    camera = scene.camera
    per_pixel = 2 * camera.half_height / size[1]
    if camera.projection == "orthographic":
        return float(per_pixel)
    box = region.box(volume.dimensions)
    bits = (np.arange(8)[:, np.newaxis] >> np.arange(3)) & 1
    corners = volume.centre + (np.take_along_axis(box, bits, axis=0) - 0.5) @ volume.box_edges.T
    depth = float(((corners - np.array(camera.eye)) @ camera.forward).min())
    return float(max(depth, 0.0) * per_pixel)
