"""Bricks: boxes of samples that a volume is cut into where its texture would be too large, each with one of its own.

A brick owns a part of the box, and every slab of every ray belongs to the brick in which the slab's middle lies. So the
bricks draw together what the whole draws, sample by sample: their partial pictures, composited in visibility order,
are the whole picture to rounding, however the volume is cut. What a brick's samples need beyond its own part, the
next sample for the interpolation and half a slab for classifications that look at its ends, it stores as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.util.errors import NoRoomError

Triple = tuple[int, int, int]
Vector = NDArray[np.float64]
_MARGINS = 8  # times its margin that a layer has to be thick
BEYOND = 1e9  # boxes: the end of a brick at which the box ends, whatever rounding says


@dataclass(frozen=True)
class Brick:
    """Its own are the samples first … last - 1 along each of x, y, z; stored_first … stored_last - 1 are stored.

    `position` is its position in the grid of bricks, `dimensions` the whole volume's, `texture_size` those of its
    texture. What is stored may be of a coarser level, whose sample i lies at `offset + factor * i`, see
    `texvol.scene.large_volume`: then `stored_first` and `stored_last` count that level's samples.
    """

    position: Triple
    first: Triple
    last: Triple
    stored_first: Triple
    stored_last: Triple
    dimensions: Triple
    texture_size: Triple
    level: int = 0
    factor: tuple[float, float, float] = (1.0, 1.0, 1.0)
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def is_whole(self) -> bool:
        """True if the brick is the whole volume."""
        return self.first == (0, 0, 0) and self.last == self.dimensions and self.level == 0

    @property
    def samples_per_box(self) -> Vector:
        """Stored samples in the length of the box."""
        return np.array(self.dimensions) / np.array(self.factor)

    @property
    def samples_before(self) -> Vector:
        """Place in the box where what is stored begins, in stored samples."""
        return np.array(self.stored_first) + (np.array(self.offset) + 0.5) / np.array(self.factor) - 0.5

    @property
    def stored_box(self) -> NDArray[np.float64]:
        """Low and high corner of what it stores, shape (2, 3); every ray that has a slab of its own goes through it."""
        count = np.array(self.stored_last) - np.array(self.stored_first)
        ends = np.array([self.samples_before, self.samples_before + count]) / self.samples_per_box
        return np.clip(ends, 0.0, 1.0)

    @property
    def has_room_beyond(self) -> list[bool]:
        """True along x, y, z where its texture goes on beyond what it stores: there the volume may end."""
        ends = zip(self.stored_first, self.stored_last, self.texture_size, strict=True)
        return [last - first < size for first, last, size in ends]

    @property
    def own_range(self) -> NDArray[np.float64]:
        """Low and high corner of its own part, shape (2, 3), far beyond the box where there is no neighbour."""
        box = np.array([self.first, self.last]) / np.array(self.dimensions)
        box[0, np.array(self.first) == 0] = -BEYOND
        box[1, np.array(self.last) == np.array(self.dimensions)] = BEYOND
        return box

    @property
    def texture_from_box(self) -> tuple[Vector, Vector, Vector]:
        """Samples per box, first sample, and textures per sample: (box * a - b) * c is a position in its texture.

        Along an axis that is cut c is a power of two where `cut` made the brick: so the position differs from that in
        the texture of the whole by a whole number of samples, to the last bit. Along others it is the same position.
        """
        # With its room beyond, the texture of a part may be as long as the box, and begin elsewhere.
        is_part = np.array(self.stored_first) != 0
        cut = (np.array(self.texture_size) != np.array(self.dimensions)) | is_part | (self.level > 0)
        samples = np.where(cut, self.samples_per_box, 1.0)
        before = np.where(cut, self.samples_before, 0.0)
        return samples, before, np.where(cut, 1.0 / np.array(self.texture_size), 1.0)


def whole(volume: Volume) -> Brick:
    """The volume as one brick."""
    dimensions = volume.dimensions
    return Brick((0, 0, 0), (0, 0, 0), dimensions, (0, 0, 0), dimensions, dimensions, dimensions)


def cut(dimensions: Triple, texture_size: Triple, margin: Triple) -> list[Brick]:
    """Bricks whose textures have `texture_size` samples, `margin` of which on every side belong to neighbours."""
    axes = [
        [
            (first, min(first + own, count), max(first - m, 0), min(first + own + m, count))
            for own in [count if size == count else size - 2 * m]
            for first in range(0, count, own)
        ]
        for count, size, m in zip(dimensions, texture_size, margin, strict=True)
    ]
    bricks = []
    for position in product(*(range(len(positions)) for positions in axes)):
        positions = zip(*(axes[axis][position[axis]] for axis in range(3)), strict=True)
        bricks.append(Brick(position, *positions, dimensions, texture_size))  # type: ignore[arg-type,call-arg]
    return bricks


def texture_size(dimensions: Triple, margin: Triple, bytes_per_sample: int, most_bytes: float, longest: int) -> Triple:
    """The largest size of a brick's texture, in samples, of at most `most_bytes` and `longest` along an axis.

    Sides that are cut are powers of two; the longest is halved until all fit, so that bricks are as cubic as they can.

    Raises
    ------
    NoRoomError
        If no brick fits that has room for samples of its own.
    """
    size = list(dimensions)
    while max(size) > longest or np.prod(size, dtype=float) * bytes_per_sample > most_bytes:
        halves = [1 << (side - 1).bit_length() - 1 if side > 1 else 1 for side in size]  # the power of two below
        cuttable = [axis for axis in range(3) if halves[axis] > 2 * margin[axis] and size[axis] > 1]
        if not cuttable:
            least = np.prod(size, dtype=float) * bytes_per_sample / 1e6
            raise NoRoomError(
                f"a brick of this volume needs {least:.3g} MB of texture memory, got {most_bytes / 1e6:.3g} MB"
            )
        longest_axis = max(cuttable, key=lambda axis: size[axis])
        size[longest_axis] = halves[longest_axis]
    return size[0], size[1], size[2]


def layered_size(dimensions: Triple, margin: Triple, bytes_per_sample: int, most_bytes: float) -> Triple | None:
    """The largest size of a brick's texture that is cut along z alone; None where most of it would be margin.

    A power of two may leave hardly more than half of three axes to a brick's own samples, and of one axis most.
    """
    nx, ny, nz = dimensions
    layers = int(most_bytes // (nx * ny * bytes_per_sample))
    layers = 1 << layers.bit_length() - 1 if layers else 0
    return (nx, ny, min(layers, nz)) if layers >= _MARGINS * max(margin[2], 1) else None


def margin(volume: Volume, camera: Camera, size: tuple[int, int], slab_thickness: float) -> Triple:
    """Samples that a brick needs beyond its own: half a slab on the most oblique ray, and the next to interpolate."""
    longest = 0.5 * slab_thickness * camera.largest_obliquity(size)
    samples = np.minimum(np.linalg.norm(volume.index_from_world, axis=1) * longest, 1e9)
    x, y, z = (1 + int(np.ceil(each)) for each in samples)
    return x, y, z


def visibility_order(bricks: Iterable[Brick], volume: Volume, camera: Camera) -> list[Brick]:
    """The bricks front to back: none hides a part of one before it.

    Along each axis of the grid a brick in front of another is nearer to the eye's position, or comes first along the
    view, so that the sum of the three ranks orders them.
    """
    bricks = list(bricks)
    view = _view(volume, camera)
    ranks = [_ranks(sorted({(b.position[axis], b.last[axis]) for b in bricks}), *view[axis]) for axis in range(3)]
    return sorted(bricks, key=lambda brick: sum(rank[p] for rank, p in zip(ranks, brick.position, strict=True)))


def _view(volume: Volume, camera: Camera) -> list[tuple[float, float, bool]]:
    """Return for each axis the eye's position in samples, the view direction, and True if rays diverge from the eye."""
    eye = volume.index_from_world @ (np.array(camera.eye) - volume.box_corner)
    forward = volume.index_from_world @ camera.forward
    return [(float(e), float(f), camera.projection == "perspective") for e, f in zip(eye, forward, strict=True)]


def _ranks(positions: Sequence[tuple[int, int]], eye: float, forward: float, diverge: bool) -> dict[int, int]:
    """Rank of each position along one axis, 0 where the view begins."""
    if not diverge:
        ordered = sorted(positions, reverse=forward < 0)
        return {position: rank for rank, (position, _) in enumerate(ordered)}
    # Outward from the position that the eye is at, counted on either side for itself.
    at = sum(last <= eye for _, last in positions)
    return {position: abs(rank - at) for rank, (position, _) in enumerate(positions)}
