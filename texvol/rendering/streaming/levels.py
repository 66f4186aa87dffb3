"""Level of each region: as fine as pixels can show, or the coarsest that keeps an error.

*By pixels.* A level is as fine as a region's nearest pixel can show if its samples lie no farther apart than pixels do.

*By error.* Rays through a coarse level predict how far each level of each region moves the picture: see
`texvol.rendering.streaming.sensitivity`. A ray has a budget, which regions of coarse levels use up. Regions are made
coarse as long as no ray goes beyond its budget, first those that save most for what they use of it. Nothing predicts
that of pictures of numbers: where an error is asked for they are of the finest level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from texvol.rendering.settings import Settings
from texvol.rendering.streaming.left_out import Floats, Guide, Numbers
from texvol.rendering.streaming.sensitivity import MOST_DEVIATIONS, Sensitivity
from texvol.scene.large_volume import LargeVolume, Level
from texvol.scene.looks import EXPOSED
from texvol.scene.scene import CompleteScene
from texvol.scene.volume import Volume
from texvol.slicing.regions import Region
from texvol.textures.distribution import Smoothed
from texvol.util.errors import InputError

_MOST_LIT = 3e7  # samples of a level whose gradients take a second or two
_OF_LEVELS = 0.75  # of an error that is asked for; slabs keep what is left, which costs no reading


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


def coarsest_by_pixels(scene: CompleteScene, size: tuple[int, int], settings: Settings, volume: LargeVolume) -> int:
    """Return a level that `levels_by_pixels` gives no region a coarser one than."""
    if not settings.coarser_by_pixels:
        return settings.level
    whole = Region((0, 0, 0), (0, 0, 0), volume.dimensions)
    return max(settings.level, _level_of(volume, _pixel_distance(scene, size, volume, whole, farthest=True)))


@dataclass(frozen=True)
class LevelsAskedFor:
    """Arguments of `Renderer.render` that decide the levels."""

    level: int | str = "auto"
    level_error: float | None = None  # that coarser levels may have; three quarters of `max_error` if None
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
    is_predicted = scene.mode == "composite" and not scene.added
    if level_error is None and level == "auto" and asked.max_error is not None:
        level_error, level = (_OF_LEVELS * asked.max_error, level) if is_predicted else (None, 0)
    if level_error is not None and scene.added:
        level_error, level = None, 0
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
        large = [each for each in scene.volumes if isinstance(each, LargeVolume)]
        numbered = zip(large, levels_beside(large, number), strict=True)
        finest = min(float((each.spacing * each.levels[level].factor).min()) for each, level in numbered)
        thickness *= finest / scene.smallest_spacing
    coarser = asked.coarser_by_pixels
    if coarser is None and level == "auto":  # slabs are as thick everywhere: if they decide, so are all samples apart
        coarser = number == settled_level(scene, size, level, None)
    thickness = min(thickness, 2 * volume.radius)
    return replace(settings, level=number, coarser_by_pixels=coarser or None, slab_thickness=thickness)


def _sooner(scene: CompleteScene, size: tuple[int, int], volume: LargeVolume, number: int) -> int:
    """Return a level for a first picture: in the light of a look, gradients of all fine samples would take seconds.

    Samples of the level are at most two pixels apart. A scene with a light of its own stays as it is.
    """
    if scene.mode != "composite" or scene.lighting != EXPOSED or number + 1 >= len(volume.levels):
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
    for volume in scene.volumes:
        remark_on_coarse_levels(volume, settings)
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


def levels_beside(volumes: Sequence[LargeVolume], number: int) -> list[int]:
    """Return levels of volumes that are drawn together: that of the first one, and no coarser ones of the others."""
    if number == 0:
        return [0] * len(volumes)
    apart = float((volumes[0].spacing * volumes[0].levels[number].factor).max())
    return [number, *(_level_of(volume, apart) for volume in volumes[1:])]


@dataclass(frozen=True)
class LevelsByError:
    """Level of each region, and how far all of them together are predicted to move the picture at most."""

    levels: list[int]
    moved: float


def levels_by_error(
    scene: CompleteScene, size: tuple[int, int], volume: LargeVolume, regions: Sequence[Region], max_error: float
) -> LevelsByError:
    """Return the coarsest levels that are predicted to keep an error: the finest where nothing predicts it."""
    finest = LevelsByError([0] * len(regions), 0.0)
    # Gradients of coarse samples are not those of fine ones; and labels have no variance.
    if not regions or max_error <= 0 or volume.levels[0].statistics is None or volume.nearest:
        return finest
    if scene.mode != "composite" or scene.medium.needs_gradient:
        return finest
    guide = Guide.of(volume, Smoothed(scene.medium, volume.smallest_spacing))
    if guide is None:
        return finest
    rays = Sensitivity(scene, size, guide, regions)
    groups = _regions_of_chunks(volume, regions)
    moved = []
    for level in range(1, guide.number + 1):  # coarser ones would have to be read
        variance = rays.variance(level)
        variance[:, [not covers(volume.levels[level], region) for region in regions] | rays.missed] = np.inf
        moved.append(np.stack([variance[:, group].sum(axis=1) for group in groups], axis=1))
    sizes = np.array([sum(np.prod(np.subtract(regions[n].last, regions[n].first)) for n in group) for group in groups])
    found, used = _coarsest(moved, sizes, (max_error / MOST_DEVIATIONS) ** 2)
    levels = np.zeros(len(regions), int)
    for level, group in zip(found, groups, strict=True):
        levels[group] = level
    return LevelsByError(levels.tolist(), MOST_DEVIATIONS * float(np.sqrt(used)))


def _regions_of_chunks(volume: LargeVolume, regions: Sequence[Region]) -> list[list[int]]:
    """Return the numbers of regions that are read together: those that begin in the same chunk."""
    groups: dict[tuple[int, ...], list[int]] = {}
    chunk = volume.levels[0].source.chunk_shape[::-1]
    for number, region in enumerate(regions):
        groups.setdefault(tuple(a // n for a, n in zip(region.first, chunk, strict=True)), []).append(number)
    return list(groups.values())


def _coarsest(moved: list[Floats], sizes: Numbers, budget: float) -> tuple[list[int], float]:
    """Return levels of parts by which no ray is moved beyond a budget, and the most that one is moved.

    Parameters
    ----------
    moved : list of arrays of shape (rays, parts)
        Variances that each part adds to each ray, for levels 1, 2, …
    sizes : array of shape (parts,)
        Samples, which coarse levels save.
    """
    levels = [0] * len(sizes)
    used = np.zeros(len(moved[0]) if moved else 1)
    for number, of_level in enumerate(moved, 1):
        before = moved[number - 2] if number > 1 else np.zeros_like(of_level)
        with np.errstate(invalid="ignore"):
            more = np.where(np.isinf(of_level), np.inf, of_level - before)
        cost = more.max(axis=0, initial=0.0) / sizes
        for part in np.argsort(cost, kind="stable").tolist():
            if levels[part] == number - 1 and np.isfinite(cost[part]) and (used + more[:, part] <= budget).all():
                levels[part], used = number, used + more[:, part]
    return levels, float(max(used.max(initial=0.0), 0.0))


def covers(level: Level, region: Region) -> bool:
    """True if the samples of a level fill a region: some pyramids leave the last ones of odd numbers out."""
    count, factor, first = np.array(level.source.shape[::-1]), np.array(level.factor), np.array(level.first)
    begins, ends = first - factor / 2, first + factor * (count - 0.5)
    return bool((begins <= np.array(region.first)).all() and (ends >= np.array(region.last) - 1).all())


def _level_of(volume: LargeVolume, apart: float) -> int:
    """Return the coarsest level whose samples lie no farther apart than so many world units."""
    fitting = [
        n for n, level in enumerate(volume.levels) if (volume.spacing * level.factor).max() <= apart * (1 + 1e-9)
    ]
    return max(fitting, default=0)


def _pixel_distance(
    scene: CompleteScene, size: tuple[int, int], volume: LargeVolume, region: Region, farthest: bool = False
) -> float:
    """Return how far pixels are apart where a region is nearest, or farthest, world units; 0 at the eye."""
    camera = scene.camera
    per_pixel = 2 * camera.half_height / size[1]
    if camera.projection == "orthographic":
        return float(per_pixel)
    box = region.box(volume.dimensions)
    bits = (np.arange(8)[:, np.newaxis] >> np.arange(3)) & 1
    corners = volume.centre + (np.take_along_axis(box, bits, axis=0) - 0.5) @ volume.box_edges.T
    depths = (corners - np.array(camera.eye)) @ camera.forward
    depth = float(depths.max() if farthest else depths.min())
    return float(max(depth, 0.0) * per_pixel)
