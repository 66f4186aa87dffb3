"""Hits of rays with triangles and lines, one by one; compiled when a scene has geometry. `layers` has the formulas."""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.compiling import compiled, compiled_and_cached, sources

_TIE = 2.0**-12  # pixels, see `hits_of_lines`


@compiled
def _edge(point, direction, a, b):
    """Return the volume, direction · (a - point) × (b - point), and True if it counts as positive."""
    ax, ay, az = a[0] - point[0], a[1] - point[1], a[2] - point[2]
    bx, by, bz = b[0] - point[0], b[1] - point[1], b[2] - point[2]
    volume = (
        direction[0] * (ay * bz - az * by) + direction[1] * (az * bx - ax * bz) + direction[2] * (ax * by - ay * bx)
    )
    goes_up = (a[0], a[1], a[2]) < (b[0], b[1], b[2])
    return volume, volume > 0.0 or (volume == 0.0 and goes_up)


@compiled
def _weights(corners, point, direction):
    """Return the weights of the corners where a ray meets a triangle; not all are positive if it does not."""
    at_a, a_side = _edge(point, direction, corners[1], corners[2])
    at_b, b_side = _edge(point, direction, corners[2], corners[0])
    at_c, c_side = _edge(point, direction, corners[0], corners[1])
    total = at_a + at_b + at_c
    if a_side != b_side or b_side != c_side or total == 0.0:
        return -1.0, -1.0, -1.0
    return at_a / total, at_b / total, at_c / total


@compiled
def _along(corner, direction):
    return corner[0] * direction[0] + corner[1] * direction[1] + corner[2] * direction[2]


@compiled
def _distance_along(position, table, radius):
    """Return the depth of a line at its point nearest to a position in the picture; negative if that is too far."""
    a, b = table[0], table[1]
    ray_x, ray_y = b[0] - a[0], b[1] - a[1]
    # Point along the longer axis to the right or up, so that a line and its reverse round alike.
    if (ray_x < 0.0) if abs(ray_x) >= abs(ray_y) else (ray_y > 0.0):
        a, b = table[1], table[0]
        ray_x, ray_y = -ray_x, -ray_y
    x, y = position[0] - a[0], position[1] - a[1]
    square = ray_x * ray_x + ray_y * ray_y
    fraction = min(max((x * ray_x + y * ray_y) / square, 0.0), 1.0) if square > 0.0 else 0.0
    weight_a, weight_b = (1.0 - fraction) * a[2], fraction * b[2]
    depth = (weight_a * a[3] + weight_b * b[3]) / (weight_a + weight_b)
    if 0.0 < fraction < 1.0:
        across = (ray_y * x - ray_x * y) / sqrt(square)
        return depth if -radius - _TIE <= across < radius - _TIE else -1.0
    off_x, off_y = x - fraction * ray_x, y - fraction * ray_y
    return depth if off_x * off_x + off_y * off_y <= radius * radius else -1.0


def _finders(sources):
    @compiled_and_cached
    def find_triangles(corners, boxes, nearest, directions, keeps, pixels, positions, weights, triangles):
        """Return the number of hits of rays with triangles; if `keeps`, write the hits to the last four arrays."""
        sources  # noqa: B018 - see compiled_and_cached
        count, width = 0, nearest.shape[1]
        for triangle in range(corners.shape[0]):
            for row in range(boxes[triangle, 1], boxes[triangle, 3] + 1):
                for column in range(boxes[triangle, 0], boxes[triangle, 2] + 1):
                    direction = directions[row, column]
                    a, b, c = _weights(corners[triangle], nearest[row, column], direction)
                    if a < 0.0 or b < 0.0 or c < 0.0:
                        continue
                    if keeps:
                        x = corners[triangle]
                        pixels[count], triangles[count] = row * width + column, triangle
                        positions[count] = (
                            a * _along(x[0], direction) + b * _along(x[1], direction) + c * _along(x[2], direction)
                        )
                        weights[count, 0], weights[count, 1], weights[count, 2] = a, b, c
                    count += 1
        return count

    @compiled_and_cached
    def find_lines(table, boxes, radius, width, keeps, pixels, depths, segments):
        """Return the number of pixels that lines cover; if `keeps`, write the hits, with depths along the view."""
        sources  # noqa: B018 - see compiled_and_cached
        count = 0
        for segment in range(table.shape[0]):
            for row in range(boxes[segment, 1], boxes[segment, 3] + 1):
                for column in range(boxes[segment, 0], boxes[segment, 2] + 1):
                    depth = _distance_along((float(column), float(row)), table[segment], radius)
                    if depth < 0.0:
                        continue
                    if keeps:
                        pixels[count], depths[count], segments[count] = row * width + column, depth, segment
                    count += 1
        return count

    return find_triangles, find_lines


find_triangles, find_lines = _finders(sources())


def hits_of_triangles(corners: NDArray, boxes: NDArray, nearest: NDArray, directions: NDArray) -> tuple[NDArray, ...]:
    """Return pixel, s, weights of the corners and number of the triangle of each hit.

    Triangles have `corners` (m, 3, 3), and `boxes` (m, 4) around them: first column and row, last column and row. Rays
    are nearest + s directions (height, width, 3); the two vectors are perpendicular to each other.
    """

    def found(count: int, keeps: bool) -> tuple[int, tuple[NDArray, ...]]:
        pixels, triangles = np.empty(count, np.int64), np.empty(count, np.int64)
        positions, weights = np.empty(count), np.empty((count, 3))
        rays = np.ascontiguousarray(nearest), np.ascontiguousarray(directions)
        of_all = np.ascontiguousarray(corners), boxes, *rays, keeps
        return find_triangles(*of_all, pixels, positions, weights, triangles), (pixels, positions, weights, triangles)

    return found(found(0, False)[0], True)[1]


def hits_of_lines(table: NDArray, boxes: NDArray, radius: float, size: tuple[int, int]) -> tuple[NDArray, ...]:
    """Return pixel, depth and number of the line of each hit.

    A line covers a pixel if the pixel's centre is less than `radius` to one side of the line, or at most `radius` to
    the other; both bounds are moved by 2^-12 pixels, as rounding would else decide between rows exactly on both.
    `table` (m, 2, 4) has column, row, weight and depth of the two ends; depths between them are weighted means.
    """

    def found(count: int, keeps: bool) -> tuple[int, tuple[NDArray, ...]]:
        arrays = np.empty(count, np.int64), np.empty(count), np.empty(count, np.int64)
        return find_lines(np.ascontiguousarray(table), boxes, float(radius), size[0], keeps, *arrays), arrays

    return found(found(0, False)[0], True)[1]
