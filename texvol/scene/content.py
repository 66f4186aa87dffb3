"""Content of a scene: samples that show, with the optical depth that each of them adds to a picture.

Statistics of at most a million samples decide, evenly spread over the volume, of a coarse level where it is in a store;
where that has no such level, the ranges of its chunks. Each stands for a cell of the volume around it. Optical depth
times area is conserved when cells are projected, so that

    opacity of a part of the picture = 1 - exp(- Σ extinction × volume of a cell / area of that part)

does not depend on how many samples there are. Crop box, clip planes, masks and NaN count.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import LargeVolume
from texvol.scene.mask import Mask
from texvol.scene.scene_parts import SceneParts
from texvol.scene.shapes import Mesh
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

Numbers = NDArray[np.float64]

_MOST_SAMPLES = 1 << 20
_FINEST = 4  # values between neighbouring samples, along each axis, as long as they are
_MOST_BETWEEN = 1 << 19
_OPAQUE = 1e3  # optical depth of a cell of infinite extinction
_NOTHING = 1e-5  # optical depth of a cell that counts as clear
_NODES = 9  # values of a chunk's range that are classified
_SAME_BOX = 1e-3  # of the box's size
_FAINT, _FAINT_LIGHT = 0.02, 0.1  # opacity that nobody sees; and light that is haze beside what is bright

_KNOWN: WeakKeyDictionary[Volume, tuple[str, tuple[Any, ...], Content]] = WeakKeyDictionary()


@dataclass(frozen=True)
class Content:
    """Samples that show.

    Parameters
    ----------
    points : array of shape (n, 3)
        World positions relative to `about`.
    amounts : array of shape (n,)
        Optical depth times area, squares of world units.
    about : array of shape (3,)
        World position.
    apart : float
        Largest distance of neighbouring samples, world units.
    faint : float
        Opacity of a part of the picture that counts as clear; of what emits, light.
    """

    points: Numbers
    amounts: Numbers
    about: Numbers
    apart: float
    faint: float = _FAINT

    @classmethod
    def nothing(cls, box: Volume) -> Content:
        """Return the content of which nothing is known."""
        return cls(np.zeros((0, 3)), np.zeros(0), box.centre, 0.0)

    def __bool__(self) -> bool:
        """True if anything shows."""
        return self.points.size > 0


@dataclass(frozen=True)
class _Samples:
    """Evenly spread samples of a volume: values, and where they lie."""

    values: NDArray
    indices: tuple[Numbers, Numbers, Numbers]  # along z, y, x of the volume's grid
    volume: Volume

    @property
    def cell(self) -> Numbers:
        """Matrix whose columns are the edges of a cell, world units."""
        steps = [each[1] - each[0] if each.size > 1 else 1.0 for each in self.indices[::-1]]
        return self.volume.world_from_index * np.array(steps)

    def world(self, found: tuple[NDArray[np.intp], ...], about: Numbers) -> Numbers:
        """Return positions of samples by their numbers along z, y and x, relative to a point."""
        places = np.tile(self.volume.origin - about, (found[0].size, 1))
        for along, each, edge in zip(self.indices[::-1], found[::-1], self.volume.world_from_index.T, strict=True):
            for axis in range(3):  # one row of numbers at a time: they are many
                places[:, axis] += (along * edge[axis])[each]
        return places


def content_of(scene: SceneParts) -> Content:
    """Return what shows of a scene with a look; nothing if that cannot be known."""
    parts = (scene.transfer_function, scene.mask, *scene.added, *scene.geometry)
    cut = f"{scene.crop} {scene.clip} {scene.mode} {scene.isovalues} {len(scene.added)}"
    known = _KNOWN.get(scene.volume)
    same = known is not None and known[0] == cut and len(known[1]) == len(parts)
    if known is None or not (same and all(one is other for one, other in zip(known[1], parts, strict=True))):
        known = _KNOWN[scene.volume] = cut, parts, _content(scene)
    return known[2]


def forget_content(volumes: Iterable[Volume]) -> None:
    """Free what is kept of the content of scenes with these first volumes: of each up to a million samples, 40 MB."""
    for volume in volumes:
        _KNOWN.pop(volume, None)


def _content(scene: SceneParts) -> Content:
    about = scene.box.centre
    owners = [(scene.volume, scene.transfer_function, scene.mask)]
    owners += [(each.volume, each.medium, each.mask) for each in scene.added]
    points, amounts, apart = [], [], 0.0
    for volume, medium, mask in owners:
        samples = _samples(volume)
        if samples is None:
            return Content.nothing(scene.box)
        found, depths, places = _shown(scene, samples, medium, mask)
        if depths.size and samples.values.ndim == 3:  # once more where something shows, and more of it
            samples = _samples_of(samples.volume, _around(samples, found))
            found, depths, places = _shown(scene, samples, medium, mask)
        area = abs(float(np.linalg.det(samples.cell))) / float(np.linalg.norm(samples.cell, axis=0).mean())
        places -= about
        points.append(places)
        amounts.append(depths * area)
        apart = max(apart, float(np.linalg.norm(samples.cell, axis=0).max()))
    for shape in scene.geometry:
        if isinstance(shape, Mesh):
            points.append(np.asarray(shape.vertices, np.float64) - about)
            amounts.append(np.full(len(points[-1]), _OPAQUE * apart**2))
    emits = any(medium is not None and medium.emissive for _, medium, _ in owners)
    return Content(_joined(points), _joined(amounts), about, apart, _FAINT_LIGHT if emits else _FAINT)


def _joined(parts: list[Numbers]) -> Numbers:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _shown(
    scene: SceneParts, samples: _Samples, medium: TransferFunction | None, mask: Mask | None
) -> tuple[tuple[NDArray[np.intp], ...], Numbers, Numbers]:
    """Return numbers along z, y, x, optical depths and world positions of the cells that show."""
    depths = _depths(scene, samples, medium)
    if mask is not None and samples.volume.shape == mask.array.shape:
        z, y, x = (np.rint(each).astype(np.intp).clip(0, None) for each in samples.indices)
        depths = depths * np.nan_to_num(mask.array[np.ix_(z, y, x)].astype(np.float64))
    found = np.nonzero(depths > _NOTHING)
    amounts, places = depths[found], samples.world(found, np.zeros(3))
    if not scene.clip and scene.crop is None:
        return found, amounts, places
    kept = _inside(scene, places)
    return tuple(each[kept] for each in found), amounts[kept], places[kept]


def _samples(volume: Volume) -> _Samples | None:
    """Return samples of all of a volume, or of the chunks of a store without a level that is coarse enough."""
    seen = volume.overview
    if seen is not volume and not _same_box(seen, volume):
        return _of_chunks(volume)
    return _samples_of(seen, [(0, count) for count in seen.shape])


def _samples_of(volume: Volume, window: Sequence[tuple[int, int]]) -> _Samples:
    """Return samples of a window of a volume, first and behind the last one along z, y, x.

    Where there are few samples, values in between are interpolated.
    """
    counts = np.array([last - first for first, last in window])
    step = _steps(counts)
    finer = int(np.clip(np.floor((_MOST_BETWEEN / counts.prod()) ** (1 / 3)), 1, _FINEST)) if max(step) == 1 else 1
    if finer == 1 or (volume.dtype.kind == "f" and not np.isfinite(volume.values).all()):
        indices = [np.arange(first, last, each, dtype=float) for (first, last), each in zip(window, step, strict=True)]
        cut = tuple(slice(first, last, each) for (first, last), each in zip(window, step, strict=True))
        return _Samples(volume.values[cut], (indices[0], indices[1], indices[2]), volume)
    values = volume.values[tuple(slice(first, last) for first, last in window)]
    offsets = (np.arange(finer) + 0.5) / finer - 0.5
    indices = []
    for axis, (first, last) in enumerate(window):
        along = (np.arange(first, last)[:, np.newaxis] + offsets).reshape(-1)
        values = _between(values, along - first, axis, nearest=volume.nearest)
        indices.append(along)
    return _Samples(values, (indices[0], indices[1], indices[2]), volume)


def _steps(counts: NDArray[np.intp]) -> list[int]:
    """Return steps along the axes; along a short axis every sample counts, and the others have wider ones for that."""
    steps = [1, 1, 1]
    while np.prod(-(-counts // steps), dtype=float) > _MOST_SAMPLES:
        steps[int(np.argmax(counts / steps))] += 1
    return steps


def _between(values: NDArray, along: Numbers, axis: int, *, nearest: bool) -> NDArray:
    """Return values at indices along an axis: linear, or the nearest one's; beyond the ends those of the ends."""
    last = values.shape[axis] - 1
    along = np.clip(along, 0, last)
    if nearest:
        return values.take(np.rint(along).astype(np.intp), axis=axis)
    before = np.minimum(along.astype(np.intp), max(last - 1, 0))
    shape = [1, 1, 1]
    shape[axis] = -1
    fraction = (along - before).astype(np.float32).reshape(shape)
    one, other = (values.take(np.minimum(each, last), axis=axis) for each in (before, before + 1))
    return np.asarray(one * (1 - fraction) + other * fraction)


def _around(samples: _Samples, found: tuple[NDArray[np.intp], ...]) -> list[tuple[int, int]]:
    """Return the window of a volume around samples that were found."""
    window = []
    for along, each, count in zip(samples.indices, found, samples.volume.shape, strict=True):
        step = along[1] - along[0] if along.size > 1 else 1.0
        first, last = along[each.min()] - step, along[each.max()] + step
        window.append((max(int(np.floor(first)), 0), min(int(np.ceil(last)) + 1, count)))
    return window


def _same_box(one: Volume, other: Volume) -> bool:
    ends = [each.corners_from_centre + each.centre for each in (one, other)]
    # Levels of halves may lack the last sample of odd numbers.
    return float(np.abs(ends[0] - ends[1]).max()) <= 2 * float(one.spacing.max()) + _SAME_BOX * other.radius


def _of_chunks(volume: Volume) -> _Samples | None:
    """Return a range of values for each chunk of a store's finest level, shape (cz, cy, cx, nodes), or None."""
    statistics = volume.levels[0].statistics if isinstance(volume, LargeVolume) else None
    if statistics is None:
        return None
    fractions = np.linspace(0, 1, _NODES)
    values = statistics.minimum[..., np.newaxis] * (1 - fractions) + statistics.maximum[..., np.newaxis] * fractions
    nz, ny, nx = statistics.chunk_shape
    middle = (np.array([nx, ny, nz]) - 1) / 2
    grid = Volume(
        np.zeros(statistics.minimum.shape, np.uint8),
        (volume.spacing * (nx, ny, nz)).tolist(),
        (volume.origin + volume.world_from_index @ middle).tolist(),
        volume.direction,
    )
    z, y, x = (np.arange(count, dtype=float) for count in grid.shape)
    return _Samples(values, (z, y, x), grid)


def _depths(scene: SceneParts, samples: _Samples, medium: TransferFunction | None) -> Numbers:
    """Return the optical depth of each cell along its mean edge, shape (nz, ny, nx); of what emits, its light."""
    values = samples.values
    if scene.mode == "isosurface":
        return _on_surfaces(values, scene.isovalues)
    if scene.mode != "composite" or medium is None:
        shown = np.isfinite(values) * _OPAQUE
        return shown if values.ndim == 3 else shown.max(axis=-1)
    length = float(np.linalg.norm(samples.cell, axis=0).mean())
    if values.dtype.kind in "iu" and values.dtype.itemsize <= 2 and not medium.needs_gradient:
        low, high = int(values.min()), int(values.max())  # few values, which are classified once
        depths = _classified(medium, np.arange(low, high + 1), None, length)[values.astype(np.int32) - low]
        return np.asarray(depths if depths.ndim == 3 else depths.max(axis=-1))
    magnitudes = _magnitudes(samples) if medium.needs_gradient else None
    depths = np.empty(values.shape[:3])
    for number, layer in enumerate(values):  # one at a time: colours take several times the memory of values
        found = _classified(medium, layer, None if magnitudes is None else magnitudes[number], length)
        depths[number] = found if found.ndim == 2 else found.max(axis=-1)
    return depths


def _classified(medium: TransferFunction, values: NDArray, magnitudes: Numbers | None, length: float) -> Numbers:
    """Return the optical depth of values along a length; of what emits, its light."""
    emission, extinction = medium.classify(values, magnitudes)
    light = emission.max(axis=-1) if medium.emissive else extinction
    return np.minimum(np.where(np.isinf(light), _OPAQUE, light * length), _OPAQUE)


def _magnitudes(samples: _Samples) -> Numbers:
    """Return gradient magnitudes by differences of the samples, data units per world unit."""
    values = np.nan_to_num(samples.values.astype(np.float64))
    if values.ndim > 3:
        return np.zeros(values.shape)
    lengths = np.linalg.norm(samples.cell, axis=0)[::-1]
    along = [np.gradient(values, length, axis=axis) for axis, length in enumerate(lengths) if values.shape[axis] > 1]
    return np.sqrt(sum((each**2 for each in along), np.zeros(values.shape)))


def _on_surfaces(values: NDArray, isovalues: tuple[float, ...]) -> Numbers:
    """Return opaque cells where neighbours lie on both sides of an isovalue."""
    found = np.zeros(values.shape[:3])
    for isovalue in isovalues:
        above = values >= isovalue
        if above.ndim > 3:
            found[above.any(axis=-1) & ~above.all(axis=-1)] = _OPAQUE
            continue
        for axis in range(3):
            one, other = (np.moveaxis(each, axis, 0) for each in (above, found))
            differs = one[1:] != one[:-1]
            other[1:][differs] = _OPAQUE
            other[:-1][differs] = _OPAQUE
    return found


def _inside(scene: SceneParts, places: Numbers) -> NDArray[np.bool_]:
    """Return True for world positions that crop box and clip planes leave."""
    kept = np.ones(len(places), np.bool_)
    for plane in scene.clip:
        kept &= places @ np.array(plane.normal) >= plane.offset
    if scene.crop is not None:
        low, high = np.array(scene.crop).T
        kept &= ((places >= low) & (places <= high)).all(axis=1)
    return kept
