"""Positions of world points in the picture: the camera's projection in float64, clipped at the eye.

A pixel (column, row) covers [column, column + 1] × [row, row + 1]; positions are measured from the upper left corner.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume

# Of the box's radius: nearer to a perspective eye, points would lie a million pictures away from the middle.
_NEAR = 1e-6
# Of a face's own size: a face seen edge on, but for rounding, counts as turned away.
_EDGE_ON = 1e-9


class Edge(NamedTuple):
    """Edge of the box: the grid axis that it follows, and its corners, with the lower index first."""

    axis: int
    start: int
    end: int


# Corner c lies on the far side of axis a if bit a of c is set, as in Volume.corners_from_centre.
EDGES = tuple(
    Edge(axis, corner, corner | 1 << axis) for axis in range(3) for corner in range(8) if not corner >> axis & 1
)


class View:
    """Box of a volume in a picture, seen by a camera."""

    def __init__(self, camera: Camera, volume: Volume, size: tuple[int, int]) -> None:
        self.camera, self.volume, self.size = camera, volume, size
        self._perspective = camera.projection == "perspective"
        self._near = _NEAR * volume.radius if self._perspective else 0.0
        self.corners = volume.corners_from_centre
        self._in_eye_space = camera.in_eye_space(self.corners, volume.centre)
        self._visible: dict[Edge, tuple[float, float] | None] = {}

    def pixel_size(self, depth: float = 1.0) -> float:
        """World units per pixel, at a depth; the depth has no effect in orthographic projection."""
        return 2 * self.camera.half_height / self.size[1] * (depth if self._perspective else 1.0)

    def positions(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the positions in the picture of points relative to the box's centre, shape (n, 2), or NaN."""
        return self._projected(self.camera.in_eye_space(points, self.volume.centre))

    def edge(self, edge: Edge) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Return the ends in the picture of an edge's part in front of the eye; None if it is behind the eye."""
        return self._in_front(self._ends(edge))

    def segment(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Return as `edge` the ends of a line between two points relative to the box's centre, shape (2, 3)."""
        return self._in_front(self.camera.in_eye_space(points, self.volume.centre))

    def _in_front(self, ends: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        depths = ends[:, 2] - self._near
        if (depths < 0).all():
            return None
        if (depths < 0).any():
            behind = int(depths[1] < 0)
            fraction = depths[behind] / (depths[behind] - depths[1 - behind])
            ends[behind] += fraction * (ends[1 - behind] - ends[behind])
            ends[behind, 2] = self._near
        first, second = self._projected(ends)
        return first, second

    def visible_part(self, edge: Edge) -> tuple[float, float] | None:
        """Return the fractions of an edge at which its visible part begins and ends; None if no part is visible."""
        if edge not in self._visible:
            self._visible[edge] = self._visible_part(edge)
        return self._visible[edge]

    def _visible_part(self, edge: Edge) -> tuple[float, float] | None:
        ends = self._ends(edge)
        scale = ends[:, 2] if self._perspective else np.ones(2)
        up = self.camera.half_height * scale
        across = up * self.size[0] / self.size[1]
        first, last = 0.0, 1.0
        # Each quantity is linear along the edge; a point is visible if none of them is negative.
        for at_start, at_end in (
            ends[:, 2] - self._near, across - ends[:, 0], across + ends[:, 0], up - ends[:, 1], up + ends[:, 1]
        ):  # fmt: skip
            if max(at_start, at_end) < 0:
                return None
            if min(at_start, at_end) < 0:
                crossing = at_start / (at_start - at_end)
                first, last = (max(first, crossing), last) if at_start < 0 else (first, min(last, crossing))
        return (first, last) if first < last else None

    def faces_that_show(self, edge: Edge) -> int:
        """Return the number of an edge's two faces that are turned towards the eye: 0 behind, 1 at the silhouette."""
        return sum(self._turned[axis][edge.start >> axis & 1] for axis in range(3) if axis != edge.axis)

    @cached_property
    def corner_positions(self) -> NDArray[np.float64]:
        """Positions of the corners in the picture, shape (8, 2), or NaN."""
        return self._projected(self._in_eye_space)

    @cached_property
    def _turned(self) -> list[tuple[bool, bool]]:
        """For each axis, True for the low and for the high face if the face is turned towards the eye."""
        inverse = np.linalg.inv(self.volume.box_edges)
        if self._perspective:
            eye = inverse @ (np.array(self.camera.eye) - self.volume.centre)  # faces lie at -½ and ½
            lost = _EDGE_ON * max(1.0, float(np.abs(eye).max()))
            return [(bool(position < -0.5 - lost), bool(position > 0.5 + lost)) for position in eye]
        direction = inverse @ self.camera.forward * np.linalg.norm(self.volume.box_edges, axis=0)
        return [(bool(step > _EDGE_ON), bool(step < -_EDGE_ON)) for step in direction]

    def _ends(self, edge: Edge) -> NDArray[np.float64]:
        """Ends of an edge in eye space, shape (2, 3)."""
        return self._in_eye_space[[edge.start, edge.end]]

    def _projected(self, in_eye_space: NDArray[np.float64]) -> NDArray[np.float64]:
        depth = in_eye_space[:, 2]
        seen = depth >= self._near * (1 - 1e-9)  # tolerates the rounding of clipped points
        pixel = np.where(seen, self.pixel_size() * (depth if self._perspective else 1.0), np.nan)
        across = in_eye_space[:, :2] / pixel[:, np.newaxis]
        return np.array(self.size) / 2 + across * (1, -1)
