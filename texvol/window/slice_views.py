"""Geometry of a slice in the world and in the window.

The plane of a slice has coordinates (x, y) in world units, to the right and down, about the middle of the first volume:

    position = origin + x right + y down

with orthogonal unit vectors. A view shows the plane with `scale` window coordinates per world unit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume
from texvol.window.slices import Slice
from texvol.window.steering import Viewport

Corners = tuple[tuple[float, float], ...]  # positions in the plane, around a parallelogram
_FILLED = 0.94  # of a view's width or height, at zoom 1: leaves room for letters at the edges


@dataclass(frozen=True)
class Plane:
    """Plane of a slice; `origin` is a point of the world, `right` and `down` are unit vectors."""

    origin: NDArray[np.float64]
    right: NDArray[np.float64]
    down: NDArray[np.float64]

    @classmethod
    def of(cls, volume: Volume, slice_: Slice, number: int) -> Plane:
        """Return the plane of a layer of samples; its right is along the grid, its down as near to it as possible."""
        (across, one), (along, other) = slice_.across, slice_.down
        index = (np.array(volume.dimensions) - 1) / 2
        index[slice_.axis] = number
        right, down = one * volume.direction[:, across], other * volume.direction[:, along]
        right = right / np.linalg.norm(right)
        down = down - (down @ right) * right
        return cls(volume.origin + volume.world_from_index @ index, right, down / np.linalg.norm(down))

    @property
    def normal(self) -> NDArray[np.float64]:
        """Unit vector perpendicular to the plane."""
        return np.cross(self.right, self.down)

    def point(self, x: float, y: float) -> NDArray[np.float64]:
        """Return the point of the world at a position in the plane."""
        return self.origin + x * self.right + y * self.down

    def position(self, point: NDArray[np.float64]) -> tuple[float, float]:
        """Return the position in the plane that is nearest to a point of the world."""
        away = point - self.origin
        return float(away @ self.right), float(away @ self.down)

    def positions(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the positions of points of shape (n, 3), shape (n, 2)."""
        return (points - self.origin) @ np.stack([self.right, self.down], axis=1)


@dataclass(frozen=True)
class SliceView:
    """Slice in a rectangle of the window; `middle` is the position of the plane in the middle of the rectangle."""

    rectangle: Viewport
    plane: Plane
    scale: float
    middle: tuple[float, float]

    @classmethod
    def of(cls, rectangle: Viewport, plane: Plane, volume: Volume, zoom: float, middle: NDArray | None) -> SliceView:
        """Return the view in which a volume fits at zoom 1; `middle` is a world point, by default the volume's."""
        spread = plane.positions(volume.centre + volume.corners_from_centre)
        low, high = spread.min(axis=0), spread.max(axis=0)
        width, height = np.maximum(high - low, 1e-300)
        scale = _FILLED * min(rectangle.width / width, rectangle.height / height) * zoom
        x, y = (low + high) / 2 if middle is None else plane.position(middle)
        return cls(rectangle, plane, float(scale), (float(x), float(y)))

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Return the window coordinates of a position in the plane."""
        box = self.rectangle
        return (
            box.x + box.width / 2 + (x - self.middle[0]) * self.scale,
            box.y + box.height / 2 + (y - self.middle[1]) * self.scale,
        )

    def point(self, x: float, y: float) -> NDArray[np.float64]:
        """Return the world point at window coordinates."""
        box = self.rectangle
        across, along = x - box.x - box.width / 2, y - box.y - box.height / 2
        return self.plane.point(self.middle[0] + across / self.scale, self.middle[1] + along / self.scale)

    @property
    def centre(self) -> NDArray[np.float64]:
        """World point in the middle of the rectangle."""
        return self.plane.point(*self.middle)


def fractions_in(one: Corners, fractions: NDArray[np.float64], other: Corners) -> NDArray[np.float64] | None:
    """Return fractions of a parallelogram, shape (n, 2), as those of another one; None if that has no area."""
    (origin, across, _, along), (start, right, _, below) = np.array(one), np.array(other)
    sides = np.stack([right - start, below - start])
    if abs(np.linalg.det(sides)) < 1e-12 * max(float((sides**2).sum()), 1e-300):
        return None
    positions = origin + fractions @ np.stack([across - origin, along - origin])
    return np.asarray(np.linalg.solve(sides.T, (positions - start).T).T)


def clipped(places: NDArray[np.float64], fractions: NDArray[np.float64]) -> tuple[NDArray, NDArray]:
    """Return the part of a convex polygon, shape (n, 2), whose fractions are from 0 to 1.

    Clipped side by side (Sutherland and Hodgman 1974).
    """
    points = np.hstack([places, fractions])
    for axis, low in ((2, True), (2, False), (3, True), (3, False)):
        inside = points[:, axis] if low else 1 - points[:, axis]
        if (inside >= 0).all():
            continue
        kept = []
        for n, point in enumerate(points):
            here, next_ = inside[n], inside[(n + 1) % len(points)]
            if here >= 0:
                kept.append(point)
            if (here < 0) != (next_ < 0):
                kept.append(point + here / (here - next_) * (points[(n + 1) % len(points)] - point))
        points = np.array(kept).reshape(-1, 4)
    return points[:, :2], points[:, 2:]


def layer_corners(volume: Volume, slice_: Slice, plane: Plane) -> Corners:
    """Return the corners of a layer of samples in the plane, around it from the upper left one, outer faces."""
    found = []
    index = volume.index_from_world @ (plane.origin - volume.origin)  # in the layer, also of a grid that is sheared
    for right, below in ((0, 0), (1, 0), (1, 1), (0, 1)):
        for (axis, sign), far in ((slice_.across, right), (slice_.down, below)):
            index[axis] = (volume.dimensions[axis] if (sign > 0) == bool(far) else 0) - 0.5
        found.append(plane.position(volume.origin + volume.world_from_index @ index))
    return tuple(found)


def cut_of(volume: Volume, plane: Plane) -> tuple[float, float, float, float] | None:
    """Return the rectangle (left, top, right, bottom) around the cut of a plane through a box; None without a cut."""
    corners = volume.centre - plane.origin + volume.corners_from_centre
    heights = corners @ plane.normal
    points = []
    for one in range(8):
        for axis in range(3):
            other = one | 1 << axis
            if other != one and (heights[one] <= 0) != (heights[other] <= 0):
                fraction = heights[one] / (heights[one] - heights[other])
                points.append(corners[one] + fraction * (corners[other] - corners[one]))
    if not points:
        return None
    places = plane.positions(np.array(points) + plane.origin)
    (left, top), (right, bottom) = places.min(axis=0).tolist(), places.max(axis=0).tolist()
    return left, top, right, bottom
