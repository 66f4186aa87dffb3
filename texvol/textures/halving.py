"""Level of detail for `post`: where slabs are thick, values are drawn from a volume halved along its axes.

Samples that lie many voxels apart wait for memory, each in a position of its own. A volume of half the samples along
each axis is an eighth of the memory, and stays in a cache. Its trilinear interpolant differs from the original's, by
less than thick slabs do from the integral.

*Halving.* A halved sample lies in the middle of a pair at -1/2 and 1/2, beside which others lie at -3/2 and 3/2.
Weighted with 1/2 + a and -a their mean has a second moment of 1/4 - 4a (spacings²). Interpolating linearly over
spacings of s adds s²/6 to it, on average over the positions: 1/6 before, 4/6 after. What is halved is curved as much as
the original if 1/4 - 4a = -1/2, so that

    a = 3/16: weights -3/16, 11/16, 11/16, -3/16

and differs in the fourth order, and by its coarser kinks; plain means of two flatten every wave, by 3/8 of its second
derivative, and move pictures two to three times as far. Values are rounded to the 65536 steps of their range, of which
the original's least value, most often that of nothing, is one: so a texture of 16 bits holds them as they are, and what
is empty in it is so in the cells that tell where to skip.

*The rule.* A halved volume is drawn where the error grows by at most a tenth of what slabs so thick cost anyway, and
pictures move by at most half of it: a tenth of the error is a twentieth of the slabs, or less, and a halved volume
takes a seventh to two fifths less time. This is not estimated voxel by voxel, since the midpoint rule's errors of many
slabs cancel along a smooth wave, and add up in noise. So a few rays are drawn here: of each the picture I of its slabs,
H of the same slabs of the halved volume, and E of slabs so much thinner that they stand for the integral, and what is
asked for is

    rms(H - E) <= 1.1 rms(I - E)        rms(H - I) <= rms(I - E) / 2

over the rays and all four channels; an eighth of the rays have to meet a medium. They go through places and in
directions that are spread evenly, whatever the camera: all views of a scene are drawn from the same volume, and the
error that grows is the usual one of its views.
"""

from __future__ import annotations

from functools import partial
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene import optics
from texvol.scene.refinement import interpolated
from texvol.scene.scene import CompleteScene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.textures.slab_texture import texel_classifier
from texvol.textures.value_storage import features_of_medium
from texvol.util.statistics import rms
from texvol.util.threads import in_threads

Axes = tuple[int, ...]  # of x, y, z

SAMPLES_APART = 4.0  # along an axis that is halved, at least; less far apart it nearly always shows
# Smaller volumes stay in a cache as they are: 128³ take 4 MB in 16 bits.
LEAST_SAMPLES = 128**3 + 1
_GROWS, _MOVES = 1.1, 1 / 2  # times the error of slabs
_RAYS = 512
_LEAST_RAYS = 64  # that meet a medium: what few of them say is chance
_FINER = 4  # slabs in one for what stands for the integral
_SHARPENED = 3 / 16
_LARGEST = 1e30  # magnitude of values: sums of some are numbers in float32
_LEAST_WIDTH = 1 / 1024  # of what a transfer function looks at, in ranges of the values
_LAYERS = 8  # halved at once: few enough for the cache
_HALVED: WeakKeyDictionary[Volume, dict[Axes, Volume]] = WeakKeyDictionary()


def is_plain(scene: CompleteScene) -> bool:
    """True for finite values without mask, colours and light, and a medium of finite extinction that they decide."""
    volume, medium = scene.volume, scene.medium
    if scene.mode != "composite" or scene.geometry or scene.mask is not None or scene.cutting.caps:
        return False
    if scene.lighting is not None or medium.needs_gradient or volume.nearest or volume.colors is not None:
        return False
    # Last of all what takes a look at every value.
    if np.isinf(medium.extinctions).any() or volume.has_missing or volume.value_range is None:
        return False
    return bool(np.isfinite(volume.value_range).all())


def may_be_coarser(scene: CompleteScene, slab_thickness: float) -> bool:
    """True if a scene of one volume may be drawn from a halved one.

    What caps and surfaces show in one position no slab's thickness hides, nor where an opaque medium begins. How many
    bricks the volume has does not matter: in bricks it is the same picture.
    """
    volume = scene.volume
    if scene.classification != "post" or not _axes_to_halve(volume, slab_thickness) or not is_plain(scene):
        return False
    assert volume.value_range is not None
    low, high = volume.value_range
    # Halved values are rounded to 65536 steps of their range; a far-off sample leaves few for all others.
    fine = features_of_medium(scene.medium, volume).finest < _LEAST_WIDTH * (high - low)
    return max(abs(low), abs(high)) < _LARGEST and not fine


def coarsest(volume: Volume, transfer_function: TransferFunction, slab_thickness: float) -> Volume:
    """The volume, or the smallest that it can be halved to without showing; the same one every time."""
    chosen, rays = volume, None
    while axes := _axes_to_halve(chosen, slab_thickness):
        rays = rays or _Rays(volume, transfer_function, slab_thickness)
        coarser = halved(chosen, axes)
        if not rays.hide(coarser):
            break
        chosen = coarser
    return chosen


def halvings(volume: Volume, drawn: Volume) -> list[int]:
    """Numbers of halvings along x, y, z from a volume to the one that was drawn."""
    return [round(np.log2(n / m)) for n, m in zip(volume.dimensions, drawn.dimensions, strict=True)]


def halved(volume: Volume, axes: Axes) -> Volume:
    """A volume of half the samples along each of `axes`, of which there are even numbers, in the same box.

    All values are finite. They become of single precision, or of double where the volume's need that. The same volume
    comes for as long as there is the one that it is made of.
    """
    known = _HALVED.setdefault(volume, {})
    if axes not in known:
        along = np.isin(np.arange(3), axes)
        known[axes] = Volume(
            _rounded(_halved_values(volume.values, axes), float(volume.values.min())),
            np.where(along, 2 * volume.spacing, volume.spacing).tolist(),
            (volume.origin + volume.world_from_index @ (0.5 * along)).tolist(),
            volume.direction,
            unit=volume.unit,
            space=volume.space,
            name=volume.name,
        )
    return known[axes]


def _axes_to_halve(volume: Volume, slab_thickness: float) -> Axes:
    if volume.size < LEAST_SAMPLES:
        return ()
    # Rounding must not tell a sampling rate of 1/8 from a thickness of 8 spacings.
    enough = slab_thickness * (1 + 1e-9) >= SAMPLES_APART * volume.spacing
    return tuple(a for a in range(3) if enough[a] and volume.dimensions[a] % 2 == 0)


def _halved_values(values: NDArray, axes: Axes) -> NDArray:
    """Values (nz, ny, nx) halved along some of x, y, z; a few layers at a time, so that nothing else is as large."""
    nz, ny, nx = (count // 2 if axis in axes else count for count, axis in zip(values.shape, (2, 1, 0), strict=True))
    narrow = values.dtype.itemsize <= 2 or values.dtype == np.float32
    wanted = np.empty((nz, ny, nx), np.float32 if narrow else np.float64)
    starts = range(0, nz, _LAYERS)
    in_threads(partial(_fill, values, axes, wanted), [slice(z, min(z + _LAYERS, nz)) for z in starts])
    return wanted


def _rounded(values: NDArray, fixed: float) -> NDArray:
    """Values rounded in place to whole steps from `fixed`, 65536 of them from the least to the largest."""
    low, high = float(values.min()), float(values.max())
    step = (high - low) / 65533  # so that there is room for as much as the ends are moved
    if step > 0:
        values -= fixed
        values *= 1 / step
        np.rint(values, out=values)
        lowest = np.floor((low - fixed) / step)
        flat = values.reshape(-1)
        flat[flat.argmin()], flat[flat.argmax()] = lowest, lowest + 65535
        values *= step
        values += fixed
    return values


def _fill(values: NDArray, axes: Axes, wanted: NDArray, layers: slice) -> None:
    if 2 in axes:
        # A pair beyond on either side; outside the volume its last samples go on.
        needed = np.clip(np.arange(2 * layers.start - 2, 2 * layers.stop + 2), 0, len(values) - 1)
        block = _halved_along(values[needed].astype(wanted.dtype, copy=False), 0)[1:-1]
    else:
        block = values[layers].astype(wanted.dtype)
    for axis in (1, 0):
        if axis in axes:
            block = _halved_along(block, 2 - axis)
    wanted[layers] = block


def _halved_along(values: NDArray, axis: int) -> NDArray:
    values = np.moveaxis(values, axis, 0)
    first, second = values[0::2], values[1::2]
    pair = first + second
    beside = np.empty_like(pair)
    beside[0], beside[1:] = first[0], second[:-1]
    beside[:-1] += first[1:]
    beside[-1] += second[-1]
    # In this form equal values stay equal: their differences are 0.
    return np.moveaxis(pair * values.dtype.type(0.5) + (pair - beside) * values.dtype.type(_SHARPENED), 0, axis)


class _Rays:
    """Rays through a volume, cut into slabs, and what the slabs show of it."""

    def __init__(self, volume: Volume, transfer_function: TransferFunction, slab_thickness: float) -> None:
        self._classifier = texel_classifier(transfer_function, "extinction", 1.0, np.inf)
        self._points, self._rays = _spread_rays(volume)
        self._ends = ends_in_box(volume, self._points, self._rays)
        self._edges = self._cut(slab_thickness)
        self._picture = self._drawn(volume, self._edges)
        self._exact = self._drawn(volume, self._cut(slab_thickness / _FINER))
        self._error = rms(self._picture - self._exact)

    def hide(self, coarser: Volume) -> bool:
        """True if the discretisation error hides the difference of another volume."""
        if np.count_nonzero(self._picture.any(axis=1)) < _LEAST_RAYS:
            return False
        drawn = self._drawn(coarser, self._edges)
        moved, error = rms(drawn - self._picture), rms(drawn - self._exact)
        return moved <= _MOVES * self._error and error <= _GROWS * self._error

    def _cut(self, thickness: float) -> NDArray[np.float64]:
        """Places along the rays between which their slabs lie, world units, shape (rays, slabs + 1)."""
        near, far = self._ends[:, 0], self._ends[:, 1]
        first = np.floor(near / thickness)
        most = int((np.ceil(far / thickness) - first).max())
        positions = (first[:, np.newaxis] + np.arange(most + 1)) * thickness
        return np.clip(positions, near[:, np.newaxis], far[:, np.newaxis])

    def _drawn(self, volume: Volume, edges: NDArray[np.float64]) -> NDArray[np.float64]:
        """Premultiplied colour and opacity of each ray, by the medium in the middle of each slab, shape (rays, 4)."""
        lengths = np.diff(edges, axis=1)
        rays, slabs = np.nonzero(lengths > 0)
        middles = 0.5 * (edges[rays, slabs] + edges[rays, slabs + 1])
        positions = self._points[rays] + middles[:, np.newaxis] * self._rays[rays]
        medium = self._classifier(_values_at(volume, positions))
        color, opacity = optics.slab_integral(medium[:, :3], medium[:, 3], lengths[rays, slabs])
        through = np.ones((len(lengths), lengths.shape[1] + 1))
        through[rays, slabs + 1] = 1 - opacity
        through = np.cumprod(through, axis=1)
        color *= through[rays, slabs][:, np.newaxis]
        channels = [np.bincount(rays, channel, len(lengths)) for channel in color.T]
        return np.column_stack([*channels, 1 - through[:, -1]])


def _spread_rays(volume: Volume) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A place of each ray from the middle of the box, and its direction, world units; each of shape (rays, 3)."""
    # Multiples of 1/g, 1/g² … 1/g⁵ with g⁶ = g + 1 fill the cube of five dimensions evenly (Roberts 2018, R5).
    numbers = np.arange(1, _RAYS + 1)[:, np.newaxis] * 1.1347241384015194 ** -np.arange(1.0, 6.0) % 1
    points = (numbers[:, :3] - 0.5) @ volume.box_edges.T
    height, angle = 2 * numbers[:, 3] - 1, 2 * np.pi * numbers[:, 4]
    across = np.sqrt(1 - height**2)
    return points, np.column_stack([across * np.cos(angle), across * np.sin(angle), height])


def ends_in_box(volume: Volume, points: NDArray[np.float64], directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances along each ray, from its start, at which the box begins and ends, shape (rays, 2)."""
    box_from_world = volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]
    position, direction = points @ box_from_world.T + 0.5, directions @ box_from_world.T
    with np.errstate(divide="ignore"):
        ends = np.stack([-position / direction, (1 - position) / direction])
    return np.column_stack([ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)])


def _values_at(volume: Volume, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interpolated values at positions from the middle of the box, world units, shape (n, 3)."""
    last = np.array(volume.dimensions) - 1
    return interpolated(volume.values, positions @ volume.index_from_world.T + 0.5 * last)
