"""Measures in slices: the map between the world and a slice of the window, and lines where a slice meets a measure."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.annotation.view import EDGES
from texvol.scene.measures.measure import Measure
from texvol.scene.volume import Volume
from texvol.window.measure_grips import corners
from texvol.window.slice_views import SliceView
from texvol.window.slices import Slice

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class SliceMap:
    """Affine map between the plane of a slice and the window.

    Attributes
    ----------
    origin : array of shape (3)
        World point at the origin of the window's coordinates.
    right, down : arrays of shape (3)
        Steps in the world for one window coordinate to the right and down.
    thickness : float
        Distance of samples across the slice: points within half of it lie in the slice.
    """

    origin: Numbers
    right: Numbers
    down: Numbers
    thickness: float

    @classmethod
    def of(cls, view: SliceView, volume: Volume, slice_: Slice) -> SliceMap:
        """Return the map of a slice of a volume in a view."""
        origin = view.point(0.0, 0.0)
        thickness = abs(float(volume.world_from_index[:, slice_.axis] @ view.plane.normal))
        return cls(origin, view.point(1.0, 0.0) - origin, view.point(0.0, 1.0) - origin, thickness)

    @property
    def normal(self) -> Numbers:
        """Unit vector across the slice."""
        across = np.cross(self.right, self.down)
        return np.asarray(across / np.linalg.norm(across))

    def point(self, x: float, y: float) -> Numbers:
        """Return the world point at window coordinates."""
        return np.asarray(self.origin + x * self.right + y * self.down)

    def positions(self, points: Numbers) -> Numbers:
        """Return the window coordinates of world points, or of the nearest points of the slice, shape (n, 2)."""
        steps = np.stack([self.right, self.down], axis=1)
        return np.asarray((points - self.origin) @ np.linalg.pinv(steps).T)

    def heights(self, points: Numbers) -> Numbers:
        """Return the distances of world points from the slice, with a sign, shape (n)."""
        return np.asarray((points - self.origin) @ self.normal)

    def holds(self, point: Numbers) -> bool:
        """True if a world point lies in the slice."""
        return abs(float(self.heights(point[np.newaxis])[0])) <= self.thickness / 2 * (1 + 1e-6)


class Line(NamedTuple):
    """Line in the window; `inside` if it lies in the slice, else it is seen through the slice."""

    start: Numbers
    end: Numbers
    inside: bool


def lines_of(each: Measure, seen: SliceMap) -> list[Line]:
    """Return the lines of a measure in a slice: those of its points, or the outline in which a slice cuts a box."""
    points = np.array(each.points)
    if each.kind == "box":
        outline = _cut(each, seen)
        return [Line(one, other, True) for one, other in pairwise([*outline, *outline[:1]])]
    inside = np.abs(seen.heights(points)) <= seen.thickness / 2 * (1 + 1e-6)
    places = seen.positions(points)
    pairs = pairwise(range(len(points)))
    return [Line(places[one], places[other], bool(inside[one] and inside[other])) for one, other in pairs]


def _cut(box: Measure, seen: SliceMap) -> list[Numbers]:
    """Return the corners of the polygon in which a slice cuts a box, in order around it."""
    ends = corners(box)
    every = np.array([[ends[corner >> axis & 1, axis] for axis in range(3)] for corner in range(8)])
    heights = seen.heights(every)
    found = []
    for _, a, b in EDGES:
        if (heights[a] < 0) != (heights[b] < 0):
            fraction = heights[a] / (heights[a] - heights[b])
            found.append(every[a] + fraction * (every[b] - every[a]))
    if len(found) < 3:
        return []
    places = seen.positions(np.array(found))
    away = places - places.mean(axis=0)
    return list(places[np.argsort(np.arctan2(away[:, 1], away[:, 0]))])
