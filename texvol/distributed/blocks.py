"""Blocks: convex parts of the box with about as much work each, by a kd-tree, which also orders them for the eye.

Of two parts on both sides of a plane the one on the eye's side hides the other and never the reverse (Fuchs, Kedem and
Naylor 1980). So pictures of the leaves composited *over* along the tree are the whole picture.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.streaming.kinds import large_volumes
from texvol.rendering.streaming.levels import levels_beside
from texvol.rendering.streaming.visibility import regions_that_show
from texvol.scene.camera import Camera
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene
from texvol.scene.volume import Volume
from texvol.slicing.bricks import BEYOND
from texvol.slicing.common_regions import common_regions
from texvol.slicing.regions import regions_of_level

Numbers = NDArray[np.float64]
Ends = tuple[tuple[int, int], ...]
T = TypeVar("T")
_CELL, _FEWEST = 16, 16  # samples along an axis of a cell, and cells along an axis of a volume in memory
_STEP = 4  # samples: every so many are looked at to tell which cells show anything
_IDLE = 0.01  # work of a cell that shows nothing, of that of one that does


@dataclass(frozen=True)
class Block:
    """A part of the box: low and high corner in fractions of it, far beyond it where it ends."""

    number: int
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    work: float = 1.0  # fraction of all

    @property
    def corners(self) -> Numbers:
        """Low and high corner, shape (2, 3)."""
        return np.array([self.low, self.high])


@dataclass(frozen=True)
class Split:
    """Two parts on both sides of a plane across an axis of the box."""

    axis: int
    at: float  # fraction of the box
    low: Tree
    high: Tree


Tree = Block | Split


def leaves(tree: Tree) -> Iterator[Block]:
    """Yield the blocks of a tree."""
    if isinstance(tree, Block):
        yield tree
    else:
        yield from leaves(tree.low)
        yield from leaves(tree.high)


def composited(tree: Tree, scene: CompleteScene, of: Callable[[Block], T], over: Callable[[T, T], T]) -> T:
    """Return what `over` makes of the blocks' pictures: always of two neighbours, the front one first."""
    if isinstance(tree, Block):
        return of(tree)
    low, high = (composited(each, scene, of, over) for each in (tree.low, tree.high))
    return over(low, high) if _sees_low_first(scene.volume, scene.camera, tree) else over(high, low)


def _sees_low_first(volume: Volume, camera: Camera, split: Split) -> bool:
    if camera.projection == "perspective":
        eye = volume.index_from_world @ (np.array(camera.eye) - volume.box_corner)
        return bool(eye[split.axis] / volume.dimensions[split.axis] < split.at)
    return bool((volume.index_from_world @ camera.forward)[split.axis] > 0)


def blocks_of(scene: CompleteScene, size: tuple[int, int], count: int, level: int = 0) -> Tree:
    """Cut the box of a scene's volume into at most `count` blocks, with about as much work each.

    A cell counts if the transfer function shows anything in it, and if its middle is on the screen. Volumes in stores
    are cut between the regions in which they are drawn from a level, and so into no more blocks than these.
    """
    edges, work = _cells_of_several(scene, size, level) if _are_stored(scene) else _cells(scene, level)
    work = np.where(_on_screen(scene, size, edges), work, 0.0)
    work = work + _IDLE * max(float(work.max()), 1.0) / max(work.size, 1) ** 0.5
    lengths = np.linalg.norm(scene.volume.box_edges, axis=0)
    cells = _Cells(edges, work, [edge * length for edge, length in zip(edges, lengths, strict=True)], itertools.count())
    return cells.cut(tuple((0, n) for n in work.shape[::-1]), count)


@dataclass(frozen=True)
class _Cells:
    """Cells of the box: edges along x, y, z in fractions of it and in the world, and work of shape (cz, cy, cx)."""

    edges: list[Numbers]
    work: Numbers
    places: list[Numbers]
    numbers: Iterator[int]  # of the blocks

    def cut(self, ends: Ends, count: int) -> Tree:
        """Cut the cells first … last - 1 along x, y, z into at most `count` blocks, across their longest side."""
        axes = [axis for axis, (first, last) in enumerate(ends) if last - first > 1]
        if count == 1 or not axes:
            return self._block(ends)
        axis = max(axes, key=lambda a: self.places[a][ends[a][1]] - self.places[a][ends[a][0]])
        first, last = ends[axis]
        others = math.prod(b - a for number, (a, b) in enumerate(ends) if number != axis)
        few = count // 2
        before = np.cumsum(self._own(ends).sum(axis=tuple(n for n in range(3) if n != 2 - axis)))
        # Each side has a cell for each of its blocks, if there are as many.
        least = min(-(-few // others), last - first - 1)
        most = max(last - first - -(-(count - few) // others), least)
        at = least + int(np.abs(before[least - 1 : most] - before[-1] * few / count).argmin())
        low, high = (
            tuple(part if number == axis else own for number, own in enumerate(ends))
            for part in ((first, first + at), (first + at, last))
        )
        return Split(axis, float(self.edges[axis][first + at]), self.cut(low, few), self.cut(high, count - few))

    def _own(self, ends: Ends) -> Numbers:
        (x0, x1), (y0, y1), (z0, z1) = ends
        return self.work[z0:z1, y0:y1, x0:x1]

    def _block(self, ends: Ends) -> Block:
        x, y, z = (
            (-BEYOND if first == 0 else float(edge[first]), BEYOND if last == len(edge) - 1 else float(edge[last]))
            for edge, (first, last) in zip(self.edges, ends, strict=True)
        )
        work = float(self._own(ends).sum() / self.work.sum())
        return Block(next(self.numbers), (x[0], y[0], z[0]), (x[1], y[1], z[1]), work)


def _cells(scene: CompleteScene, level: int) -> tuple[list[Numbers], Numbers]:
    """Return the edges of cells along x, y, z in fractions of the box, and the work of each, shape (cz, cy, cx)."""
    volume = scene.volume
    if isinstance(volume, LargeVolume):
        regions = regions_of_level(volume, level)
        last = [np.unique([region.last[axis] for region in regions]) for axis in range(3)]
        edges = [np.append(0, each) / n for each, n in zip(last, volume.dimensions, strict=True)]
        return edges, _shown(scene, edges)
    steps = [max(min(_CELL, -(-n // _FEWEST)), 1) for n in volume.dimensions]
    edges = [np.append(np.arange(0, n, step), n) / n for n, step in zip(volume.dimensions, steps, strict=True)]
    return edges, _shown(scene, edges)


def _are_stored(scene: CompleteScene) -> bool:
    """True if several volumes are drawn in regions that they have in common."""
    return bool(scene.added) and isinstance(scene.volume, LargeVolume)


def _cells_of_several(scene: CompleteScene, size: tuple[int, int], level: int) -> tuple[list[Numbers], Numbers]:
    """Return `_cells` of several large volumes: regions that they have in common, and the samples that show there."""
    volumes = large_volumes(scene)
    common = common_regions(volumes, levels_beside(volumes, level), [np.ones(3)] * len(volumes))
    frame, first = common.frame, scene.volume
    last = [np.unique([region.last[axis] for region in common.regions]) for axis in range(3)]
    work = np.zeros([len(each) for each in reversed(last)])
    for alone, volume, own in zip(scene.each_alone(), volumes, common.own, strict=True):
        for region in regions_that_show(alone, size, volume, list(own.values()), np.ones(3), np.zeros(3)):
            work[region.position[::-1]] += np.prod(np.subtract(region.last, region.first), dtype=float)
    # Both boxes have the same axes.
    lengths = [np.linalg.norm(each.box_edges, axis=0) for each in (frame, first)]
    aside = first.index_from_world @ (frame.centre - first.centre) / np.array(first.dimensions)
    ratio = lengths[0] / lengths[1]
    edges = [
        0.5 + aside[axis] + (np.append(0, last[axis]) / frame.dimensions[axis] - 0.5) * ratio[axis] for axis in range(3)
    ]
    return edges, work


def _shown(scene: CompleteScene, edges: list[Numbers]) -> Numbers:
    """Return the samples of each cell in which anything shows, by the store's statistics or by some of the samples."""
    volume = scene.volume
    statistics = volume.levels[0].statistics if isinstance(volume, LargeVolume) else None
    if statistics is not None:
        shows = scene.medium.shows_between(statistics.lowest_around, statistics.highest_around, np.inf)
    else:
        looked_at = volume.overview if isinstance(volume, LargeVolume) else volume
        values = np.asarray(looked_at.values[::_STEP, ::_STEP, ::_STEP], np.float64)
        shows = scene.medium.shows_between(values, values, np.inf)
    counts = np.array(shows, np.float64)
    for axis, own in enumerate(reversed(edges)):
        # Of each cell the part of the samples that lie in it, as an integral over fractions of the box.
        n = counts.shape[axis]
        until = np.insert(np.cumsum(counts, axis=axis), 0, 0.0, axis=axis)
        at = np.clip(own * n, 0, n)
        below = np.minimum(at.astype(int), n - 1)
        part = (at - below).reshape([-1 if a == axis else 1 for a in range(3)])
        low = np.take(until, below, axis=axis)
        counts = np.diff(low + part * (np.take(until, below + 1, axis=axis) - low), axis=axis)
    return counts


def _on_screen(scene: CompleteScene, size: tuple[int, int], edges: list[Numbers]) -> NDArray[np.bool_]:
    """Return which cells have their middle on the screen or beside it, shape (cz, cy, cx)."""
    x, y, z = ((each[1:] + each[:-1]) / 2 - 0.5 for each in edges)
    box = np.stack(np.broadcast_arrays(x, y[:, np.newaxis], z[:, np.newaxis, np.newaxis]), axis=-1)
    camera, volume = scene.camera, scene.volume
    world = box @ volume.box_edges.T + (volume.centre - np.array(camera.eye))
    right, up, depth = (world @ np.asarray(axis) for axis in (camera.right, camera.upward, camera.forward))
    half = camera.half_height * (depth if camera.projection == "perspective" else 1.0)
    cell = max(float(np.linalg.norm(volume.box_edges, axis=0)[a] * np.diff(each).max()) for a, each in enumerate(edges))
    beside = np.abs(half) + cell
    return (np.abs(up) <= beside) & (np.abs(right) <= beside * size[0] / size[1]) & (depth > -cell)
