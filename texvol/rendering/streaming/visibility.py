"""Regions and chunks of a large volume that may be seen, by statistics, camera, cuts and what is opaque already."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.projection import Isovalue
from texvol.scene.large_volume import LargeVolume, Level
from texvol.scene.scene import CompleteScene
from texvol.scene.volume import Volume
from texvol.slicing.bricks import Brick
from texvol.slicing.coverage import in_common, pixel_boxes_of, pixels_of
from texvol.slicing.regions import Region

Box = NDArray[np.float64]
Places = NDArray[np.intp]
_LEAST = 2.0**-24  # transmittance that float32 tells from none
_AT_ONCE = 4096  # regions whose corners are worked out together: a volume may have a million
_FEW_DRAWN = 4  # bricks, after which the picture is read again
AHEAD = 6  # regions that are read before they are drawn, as far as memory goes


class Hiding(Protocol):
    """Knowledge of a picture that is being drawn: what needs no more be read, because it would not change it."""

    hidden: int  # bricks so far

    def hides(self, brick: Brick) -> bool:
        """True if a brick would change nothing; it counts as hidden then."""

    def may_hide(self, brick: Brick, before: Sequence[Brick]) -> bool:
        """True if a brick may turn out to be hidden when some others, which are not drawn yet, are."""

    @property
    def tells_chunks(self) -> bool:
        """True if `are_hidden` may find anything."""

    def are_hidden(self, level: int, places: Places, parts: Box) -> NDArray[np.bool_]:
        """Return which chunks of a level would change nothing.

        Parameters
        ----------
        places : array of shape (n, 3)
            Of the chunks in the level's grid, along z, y, x.
        parts : array of shape (n, 2, 3)
            Low and high corner, in fractions of the box, of all that depends on their samples.
        """

    def has_drawn(self, compositor: Compositor, brick: Brick, values: tuple[float, float] | None) -> None:
        """Remember that a brick of a range of values has been drawn."""


class Screen:
    """Pixels that are opaque, so that nothing behind them has to be read."""

    def __init__(self, scene: CompleteScene, size: tuple[int, int], least_transmittance: float) -> None:
        self._scene, self._size = scene, size
        # A ray that lets no more through ends in front of it.
        self._opaque_from = 1.0 - least_transmittance
        self._may_be_opaque = least_transmittance > 0
        self._enough = -math.log(least_transmittance) if least_transmittance > 0 else math.inf  # optical depth
        self._deepest = np.zeros((size[1], size[0]))  # that a pixel's ray may have passed
        self._opaque = np.zeros((size[1], size[0]), np.bool_)
        self._known: dict[Brick, tuple[tuple[slice, slice], NDArray[np.bool_]]] = {}
        self._changed: list[tuple[slice, slice]] = []  # boxes of pixels that were drawn into since they were read
        self._compositor: Compositor | None = None
        self.hidden = 0

    def hides(self, brick: Brick) -> bool:
        """True if all pixels that a brick may reach are opaque; it counts as hidden then."""
        hidden = self.covers(brick)
        self.hidden += hidden
        return hidden

    def covers(self, brick: Brick) -> bool:
        """True if all pixels that a brick may reach are opaque."""
        if not self._may_be_opaque:
            return False
        where, mask = self._pixels(brick)
        if (self._deepest[where][mask] < self._enough).any():
            return False
        self._update()
        return bool((self._opaque[where] | ~mask).all())

    def may_hide(self, brick: Brick, before: Sequence[Brick]) -> bool:
        """True if bricks that are not drawn yet may make all pixels opaque that a brick may reach."""
        if not self._may_be_opaque:
            return False
        where, mask = self._pixels(brick)
        pending = self._deepest[where].copy()
        for each in before:
            own, covers = self._pixels(each)
            if (common := in_common(where, own)) is not None:
                here, there = common
                pending[here] += np.where(covers[there], self._depth_of(each, None), 0.0)
        return bool(((pending >= self._enough) | ~mask).all())

    @property
    def tells_chunks(self) -> bool:
        """True if `are_hidden` may find anything."""
        return self._may_be_opaque and bool((self._deepest >= self._enough).any())

    def are_hidden(self, level: int, places: Places, parts: Box) -> NDArray[np.bool_]:
        """Return which parts of the box only pixels may show that were opaque a few bricks ago, wherever they are."""
        return self.all_opaque(self._scene.volume, parts)

    def all_opaque(self, volume: Volume, parts: Box) -> NDArray[np.bool_]:
        """Return which parts of a volume's box, shape (n, 2, 3), only such pixels may show."""
        if len(self._changed) >= _FEW_DRAWN:
            self._update()
        low, high = pixel_boxes_of(volume, self._scene.camera, self._size, parts)
        corner = low.min(axis=0)
        (x0, y0), (x1, y1), (right, below) = (low - corner).T, (high - corner).T, high.max(axis=0)
        clear = np.pad(~self._opaque[corner[1] : below, corner[0] : right], ((1, 0), (1, 0)))
        table = clear.cumsum(axis=0, dtype=np.int32).cumsum(axis=1, dtype=np.int32)
        return table[y1, x1] - table[y0, x1] - table[y1, x0] + table[y0, x0] == 0

    def has_drawn(self, compositor: Compositor, brick: Brick, values: tuple[float, float] | None) -> None:
        """Remember that a brick of a range of values has been drawn."""
        self.has_added(compositor, brick, self._depth_of(brick, values))

    def has_added(self, compositor: Compositor, brick: Brick, depth: float) -> None:
        """Remember that a brick has been drawn, through which the optical depth is at most so much."""
        self._compositor = compositor
        where, mask = self._pixels(brick)
        if mask.size:
            self._changed.append(where)
        self._deepest[where][mask] += depth
        self._known.pop(brick, None)

    def _depth_of(self, brick: Brick, values: tuple[float, float] | None) -> float:
        """Upper bound of the optical depth of a brick whose values are in a range, None for any."""
        if self._scene.mode == "isosurface":
            return math.inf
        return most_extinction(self._scene, values) * self.longest(brick)

    def longest(self, brick: Brick) -> float:
        """Return the length of the longest path through a brick, world units."""
        return float(np.linalg.norm(self._scene.volume.box_edges @ np.ptp(brick.stored_box, axis=0)))

    def _update(self) -> None:
        if self._changed and self._compositor is not None:
            rows, columns = (slice(min(each.start for each in along), max(each.stop for each in along))
                             for along in zip(*self._changed, strict=True))  # fmt: skip
            opacity = self._compositor.opacity(rows, columns)
            self._opaque[rows, columns] = opaque = opacity >= self._opaque_from
            # From here on what is known counts, and not what might have been.
            known = np.where(opaque, self._enough, -np.log1p(-np.minimum(opacity, 1 - _LEAST)))
            self._deepest[rows, columns] = known
            self._changed.clear()

    def _pixels(self, brick: Brick) -> tuple[tuple[slice, slice], NDArray[np.bool_]]:
        if brick not in self._known:
            part = np.clip(brick.stored_box, 0, 1)
            self._known[brick] = pixels_of(self._scene.volume, self._scene.camera, self._size, part)
        return self._known[brick]


def most_extinction(scene: CompleteScene, values: tuple[float, float] | None) -> float:
    """Upper bound of the extinction in a range of values, None for any."""
    medium = scene.medium
    if medium.needs_gradient or scene.cutting.caps:
        return math.inf
    if values is None:
        return float(medium.extinctions.max())
    places = np.clip(medium.values, *values)  # and on either side of them
    near = np.concatenate([places, np.nextafter(places, -np.inf), np.nextafter(places, np.inf)])
    return float(medium.classify(near).extinction.max())


def needed_chunks(scene: CompleteScene, volume: LargeVolume, level: int, beyond: Box) -> NDArray[np.bool_] | None:
    """Return which chunks of a level may matter, shape (cz, cy, cx); None where nothing is known.

    `beyond` is how far matter is seen from its place, in samples of level 0 along x, y, z; surfaces take the samples
    that their gradients are made of. Where nothing shows in a chunk nothing shows between its samples and the next ones
    around, whatever its own samples are.
    """
    shows = chunks_that_show(scene, volume)
    if shows is None:
        return None
    if scene.mode == "isosurface":
        if volume.levels[level].statistics is None:  # which tell the value that stands for a chunk
            return None
        beyond = beyond_chunks(volume.levels[level]) + scene.gradient.reach * np.array(volume.levels[level].factor)
    statistics = volume.levels[0].statistics
    assert statistics is not None
    own = volume.levels[level]
    chunk = np.array(own.source.chunk_shape)
    count = -(-np.array(own.source.shape) // chunk)
    needed = shows
    for axis, fine in enumerate(statistics.chunk_shape):
        of_xyz = 2 - axis
        factor, first = own.factor[of_xyz], own.first[of_xyz]
        ends = np.arange(shows.shape[axis] + 1) * fine - 0.5 - first
        low = (ends[:-1] - beyond[of_xyz]) / factor + 0.5
        high = (ends[1:] + beyond[of_xyz]) / factor + 0.5
        starts = np.clip(np.floor((low + 1e-6) / chunk[axis]), 0, count[axis] - 1)
        stops = np.clip(np.ceil((high - 1e-6) / chunk[axis]), 1, count[axis])
        own_chunks = np.arange(count[axis])[:, np.newaxis]
        takes = (starts <= own_chunks) & (own_chunks < stops)  # which chunks of level 0 each of its own needs
        needed = np.moveaxis(np.tensordot(takes.astype(np.float32), needed.astype(np.float32), (1, axis)) > 0, 0, axis)
    return needed


def beyond_chunks(level: Level) -> Box:
    """Return how far from chunks whose values are on both sides of an isovalue a surface of a level may lie, (3,).

    In samples of level 0 along x, y, z. Of the finest level the surface lies in them. A sample of a coarse one stands
    for some that may lie in such a chunk, and is interpolated with the next one.
    """
    factor = np.array(level.factor)
    return np.where(factor > 1, 2 * factor, 0.0)


def regions_that_show(
    scene: CompleteScene, size: tuple[int, int], volume: LargeVolume, regions: list[Region], margin: Box, beyond: Box
) -> list[Region]:
    """Return the regions without those known to show nothing: empty, cut away, or off the screen.

    `margin` is what their outermost slabs reach beyond them, `beyond` how far matter is seen from its place, both in
    samples along x, y, z.
    """
    batches = (regions[first : first + _AT_ONCE] for first in range(0, len(regions), _AT_ONCE))
    on_screen = [region for batch in batches for region in _on_screen(scene, size, volume, batch, margin, beyond)]
    shows = chunks_that_show(scene, volume)
    if shows is None:
        return on_screen
    statistics = volume.levels[0].statistics
    assert statistics is not None
    reach, chunk = np.ceil(beyond[::-1]).astype(int).tolist(), statistics.chunk_shape

    def chunks(region: Region) -> tuple[slice, ...]:
        ends = zip(region.first[::-1], region.last[::-1], chunk, reach, strict=True)
        return tuple(slice(max(a - more, 0) // n, -(-(b + more) // n)) for a, b, n, more in ends)

    return [region for region in on_screen if shows[chunks(region)].any()]


def _on_screen(
    scene: CompleteScene,
    size: tuple[int, int],
    volume: LargeVolume,
    regions: list[Region],
    margin: Box,
    beyond: Box,
) -> list[Region]:
    dimensions = np.array(volume.dimensions)
    boxes = np.array([(each.first, each.last) for each in regions]) / dimensions
    low, high = pixel_boxes_of(volume, scene.camera, size, boxes + np.outer([-1, 1], beyond / dimensions))
    may_show = (low < high).all(axis=1)
    may_show &= ~_are_cut_away(scene, volume, boxes + np.outer([-1, 1], margin / dimensions))
    return [region for region, may in zip(regions, may_show, strict=True) if may]


def shown_box(
    scene: CompleteScene, volume: LargeVolume, first: NDArray[np.intp], last: NDArray[np.intp]
) -> NDArray[np.float64] | None:
    """Return the box of level 0's samples around all chunks that show anything from `first` to `last`, shape (2, 3).

    None where nothing is known, or nothing shows. All are along x, y, z.
    """
    shows = chunks_that_show(scene, volume)
    if shows is None:
        return None
    statistics = volume.levels[0].statistics
    assert statistics is not None
    chunk = np.array(statistics.chunk_shape[::-1])
    low = np.maximum(first, 0) // chunk
    (x0, y0, z0), (x1, y1, z1) = low, -(-last // chunk)
    z, y, x = np.nonzero(shows[z0:z1, y0:y1, x0:x1])
    if not z.size:
        return None
    ends = [[x.min(), y.min(), z.min()], [x.max() + 1, y.max() + 1, z.max() + 1]]
    return (np.array(ends) + low) * chunk.astype(np.float64)


def chunks_that_show(scene: CompleteScene, volume: LargeVolume) -> NDArray[np.bool_] | None:
    """Return which chunks of level 0 may show anything, shape (cz, cy, cx); None where nothing is known.

    In modes other than composite and isosurface every value counts.
    """
    statistics = volume.levels[0].statistics
    if statistics is None or scene.mode not in ("composite", "isosurface"):
        return None
    known: tuple[object, NDArray[np.bool_]] | None = scene.__dict__.get("_chunks_that_show")
    if known is None or known[0] is not volume:
        shown = scene.medium if scene.mode == "composite" else Isovalue(scene.isovalues)
        shows = shown.shows_between(statistics.lowest_around, statistics.highest_around, np.inf)
        if scene.needs_gradient and scene.mode == "composite":
            shows = _spread(shows)  # what is lit or graded there depends on samples farther away
        known = volume, shows
        object.__setattr__(scene, "_chunks_that_show", known)
    return known[1]


def _spread(shows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    padded = np.pad(shows, 1)
    for axis in range(3):
        padded = padded | np.roll(padded, 1, axis) | np.roll(padded, -1, axis)
    return padded[1:-1, 1:-1, 1:-1]


def _are_cut_away(scene: CompleteScene, volume: LargeVolume, boxes: Box) -> NDArray[np.bool_]:
    """Return which boxes, in fractions of the volume's, shape (n, 2, 3), clip planes and crop leave nothing of."""
    normals, distances = scene.cutting.half_spaces(volume)
    bits = (np.arange(8)[:, np.newaxis] >> np.arange(3)) & 1
    corners = (boxes[:, bits, np.arange(3)] - 0.5) @ volume.box_edges.T
    cut_away: NDArray[np.bool_] = ((corners @ normals.T).max(axis=1) < distances).any(axis=1)
    return cut_away
