"""Triangles and lines projected to the picture in float64, with the numbers that the shader intersects rays by.

A point X, Y, Z of eye space, X and Y counted in pixels, is the homogeneous point v = (X, Y, W) of the picture, W = Z in
perspective and 1 otherwise. The ray of the pixel at r = (x, y, 1), counted from the middle, is t r. With n0 = v1 × v2,
n1 = v2 × v0, n2 = v0 × v1 and e_i = n_i · r it meets the plane of a triangle at the weights e_i / (e0 + e1 + e2) of the
corners, and in front of the eye, inside the triangle, just if all e_i have the sign of v0 · n0 (Olano, Greer 1997). So
triangles through the plane of the eye need no clipping. Neighbours have the same n with opposite sign, to the last bit:
no ray slips through between two, and none meets both.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.shapes import Lines, Mesh, Shape
from texvol.scene.volume import Volume
from texvol.util.threads import in_threads

Numbers = NDArray[np.float64]
Pixels = NDArray[np.int32]
EDGE_ON = 1e-12  # sine of the angle under which a triangle is seen edge on, and so not at all
TIE = 2.0**-12  # pixels by which a line's band is moved, so that rounding doesn't decide between two rows at its rims
_MARGIN = 1 / 16  # pixel around what a primitive covers: drivers snap corners to 1/256, and float32 rounds them
_FARTHEST = 16  # pictures: beyond, float32 has too few digits left for corners
_DEEPEST = 1e30  # slabs
_MARGINS = np.array([[-_MARGIN], [_MARGIN]])
_AT_ONCE = 1 << 14  # triangles of one thread's part, whose numbers stay in the cache of a core


class Primitives(NamedTuple):
    """Triangles and lines that the picture may show, in the order of the scene: those near the centre of a pixel."""

    # Of a triangle the rows (a, b, c, d): its e_i is a x + b y + c, and its corner is at depth d. Of a line the ends
    # (x, y, 1 / W, depth) and, in the third row, half the width. In float32, followed by the rest that it leaves, and
    # the normals at the corners, of length 1 or 0, where there is light: shape (n, 6, 4), or (n, 9, 4).
    texels: NDArray[np.float32]
    pixels: Pixels  # the first one, and the one behind the last, of the rectangle around the primitive, (n, 2, 2)
    # Corners of two triangles that cover the primitive, shape (n, 6, 2); the fragments of a pixel come in the order of
    # the primitives. Shape (n, 0, 2) where none were asked for.
    covers: Numbers
    shape: NDArray[np.int64]  # number of the shape that the primitive belongs to, (n)


class _View(NamedTuple):
    camera: Camera
    half: Numbers  # of the picture, in pixels
    centre: Numbers  # of the volume
    pixel: float  # world units, at depth 1 in perspective
    slab_thickness: float
    covered: bool  # True if covers are asked for
    lit: bool  # True if normals are

    @property
    def diverges(self) -> bool:
        return self.camera.projection == "perspective"

    def points(self, world: Numbers) -> tuple[Numbers, Numbers]:
        """Homogeneous points (n, 3) of the picture, and their depths in slabs from the middle of the box."""
        from_centre = world - self.centre
        in_eye_space = self.camera.in_eye_space(from_centre, self.centre)
        depths = np.clip(from_centre @ self.camera.forward / self.slab_thickness, -_DEEPEST, _DEEPEST)
        points = in_eye_space / (self.pixel, self.pixel, 1.0)
        if not self.diverges:
            points[:, 2] = 1.0
        return points, depths


class _Placed(NamedTuple):
    """Vertices of a mesh in the picture."""

    points: Numbers  # homogeneous, (n, 3)
    positions: Numbers  # in pixels from the middle, (n, 2)
    depths: Numbers  # in slabs
    normals: Numbers | None  # of length 1 or 0, (n, 3)


def primitives_of(
    shapes: Sequence[Shape],
    volume: Volume,
    camera: Camera,
    size: tuple[int, int],
    slab_thickness: float,
    *,
    covered: bool = True,
    lit: bool = True,
) -> Primitives:
    """All of them, those that can't be seen left out; `size` is (width, height) in pixels."""
    pixel = 2 * camera.half_height / size[1]
    view = _View(camera, np.array(size) / 2, volume.centre, pixel, slab_thickness, covered, lit)
    parts: list[Primitives] = []
    for number, shape in enumerate(shapes):
        parts += [_lines(shape, view, number)] if isinstance(shape, Lines) else _triangles(shape, view, number)
    return Primitives(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _triangles(mesh: Mesh, view: _View, number: int) -> list[Primitives]:
    points, depths = view.points(mesh.vertices)
    with np.errstate(divide="ignore", invalid="ignore"):
        positions = points[:, :2] / points[:, 2:]
    placed = _Placed(points, positions, depths, None if mesh.normals is None else _units(mesh.normals))
    starts = range(0, max(len(mesh.triangles), 1), _AT_ONCE)
    parts = [mesh.triangles[start : start + _AT_ONCE] for start in starts]
    return in_threads(lambda triangles: _some_triangles(mesh, triangles, placed, view, number), parts)


def _some_triangles(
    mesh: Mesh, triangles: NDArray[np.integer], placed: _Placed, view: _View, number: int
) -> Primitives:
    through_eye = placed.points[triangles, 2] <= 0
    rectangles = _around(placed.positions[triangles])
    pixels = _pixels_in(rectangles, view.half)
    may_be_seen = np.where(through_eye.any(axis=1), ~through_eye.all(axis=1), _is_any(pixels))
    facet, is_seen = _facets(mesh.vertices[triangles[may_be_seen]], view)
    kept = np.flatnonzero(may_be_seen)[is_seen]
    triangles, rectangles, pixels, facet = triangles[kept], rectangles[kept], pixels[kept], facet[is_seen]
    points, depths, cut = placed.points[triangles], placed.depths[triangles], through_eye[kept].any(axis=1)
    edges = np.cross(points[:, [1, 2, 0]], points[:, [2, 0, 1]])
    edges *= np.sign((points[:, 0] * edges[:, 0]).sum(axis=1))[:, np.newaxis, np.newaxis]
    edges *= _power_of_two(edges.reshape(-1, 9))[:, np.newaxis, np.newaxis]
    if cut.any():
        rectangles[cut] = _cut_rectangles(points[cut], edges[cut], view.half + _MARGIN) + _MARGINS
        pixels[cut] = _pixels_in(rectangles[cut], view.half)
    covers = _covers(placed.positions[triangles], rectangles, cut, view) if view.covered else None
    if placed.normals is None:
        normals = np.broadcast_to(facet[:, np.newaxis], (len(kept), 3, 3))
    else:
        normals = placed.normals[triangles]
    numbers = np.concatenate([edges, depths[..., np.newaxis]], axis=-1)
    return _inside_picture(numbers, normals, pixels, covers, number, view)


def _lines(lines: Lines, view: _View, number: int) -> Primitives:
    points, depths = view.points(lines.points)
    ends = np.column_stack([points, depths])[lines.segments.T]  # (2, n, 4): X, Y, W, depth
    radius = lines.width / 2
    first, last = _in_frustum(ends[0, :, :3], ends[1, :, :3], view.half + radius + 2 * _MARGIN)
    kept = first < last
    first, last, ends = first[kept, np.newaxis], last[kept, np.newaxis], ends[:, kept]
    # Both ends from the nearer one of the line, so that an end that is not cut stays where it is.
    start = ends[0] + first * (ends[1] - ends[0])
    end = np.where(last < 1, ends[0] + last * (ends[1] - ends[0]), ends[1])
    placed = np.stack([start, end], axis=1)
    weights = placed[..., 2:3]
    numbers = np.zeros((len(placed), 3, 4))
    numbers[:, :2, :2] = placed[..., :2] / weights
    numbers[:, :2, 2:3] = weights.max(axis=1, keepdims=True) / weights
    numbers[:, :2, 3] = placed[..., 3]
    numbers[:, 2, 0] = radius
    # One way along the longer axis, so that the band of pixels has its open side where the next one has it.
    direction = numbers[:, 1, :2] - numbers[:, 0, :2]
    longer = np.abs(direction[:, 0]) >= np.abs(direction[:, 1])
    backward = np.where(longer, direction[:, 0], direction[:, 1]) < 0
    numbers[backward, :2] = numbers[backward, 1::-1]
    reach = radius + _MARGIN
    rectangles = np.stack([numbers[:, :2, :2].min(axis=1) - reach, numbers[:, :2, :2].max(axis=1) + reach], axis=1)
    covers = _as_triangles(rectangles, view) if view.covered else None
    pixels, normals = _pixels_in(rectangles, view.half), np.zeros((len(numbers), 3, 3))
    return _inside_picture(numbers, normals, pixels, covers, number, view)


def _facets(corners: Numbers, view: _View) -> tuple[Numbers, NDArray[np.bool_]]:
    """Unit normals of triangles (n, 3, 3), and whether they show the eye more than an edge."""
    sides = corners[:, 1:] - corners[:, :1]
    sides = sides * _power_of_two(sides.reshape(-1, 6))[:, np.newaxis, np.newaxis]
    normals = _units(np.cross(sides[:, 0], sides[:, 1]))
    direction = corners[:, 0] - np.array(view.camera.eye) if view.diverges else view.camera.forward
    distance = np.linalg.norm(direction, axis=-1)
    return normals, np.abs((normals * direction).sum(axis=-1)) > EDGE_ON * distance


def _around(positions: Numbers) -> Numbers:
    """Rectangles (n, 2, 2) around triangles (n, 3, 2), with a margin."""
    a, b, c = (positions[:, i] for i in range(3))
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    return np.stack([low, high], axis=1) + _MARGINS


def _covers(positions: Numbers, rectangles: Numbers, cut: NDArray[np.bool_], view: _View) -> Numbers:
    """Two triangles around each of triangles (n, 3, 2): its rectangle, or just itself, whichever is smaller."""
    covers = _as_triangles(rectangles, view)
    around = _widened(positions)
    with np.errstate(invalid="ignore"):
        is_near = (np.abs(around) < _FARTHEST * view.half).all(axis=(1, 2))
        is_smaller = _area(around) < 2 * _area(covers[:, :3])
    itself = np.flatnonzero(is_near & is_smaller & ~cut)
    covers[itself, :3], covers[itself, 3:] = around[itself], around[itself, :1]
    return covers


def _widened(positions: Numbers) -> Numbers:
    """Triangles (n, 3, 2) with each side moved outward by the margin; not finite where one is flat."""
    following = np.roll(positions, -1, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        directions = following - positions
        directions = directions / np.linalg.norm(directions, axis=2, keepdims=True)  # from corner i to i + 1
        before = np.roll(directions, 1, axis=1)  # to corner i
        sine = before[..., 0] * directions[..., 1] - before[..., 1] * directions[..., 0]
        # Where the sides that meet in a corner are moved outward by m, it moves by m (before - following) / |sine|.
        return positions + _MARGIN * (before - directions) / np.abs(sine)[..., np.newaxis]


def _area(corners: Numbers) -> Numbers:
    (ax, ay), (bx, by) = (np.moveaxis(corners[:, i] - corners[:, 0], 1, 0) for i in (1, 2))
    return np.abs(ax * by - ay * bx) / 2


def _as_triangles(rectangles: Numbers, view: _View) -> Numbers:
    """Two triangles for each of the rectangles (n, 2, 2), as far as they are near the picture."""
    border = view.half + 1.0
    low, high = np.moveaxis(np.clip(rectangles, -border, border), 1, 0)
    x, y = (np.stack([low[:, axis], high[:, axis]], axis=1) for axis in (0, 1))
    return np.stack([x[:, [0, 1, 1, 0, 1, 0]], y[:, [0, 0, 1, 0, 1, 1]]], axis=-1)


def _cut_rectangles(points: Numbers, edges: Numbers, half: Numbers) -> Numbers:
    """Rectangles around triangles that cross the plane of the eye, from their part in the frustum of `half` the size.

    These parts have their corners among the triangles' own, the positions where their edges meet the frustum's sides,
    and those where the frustum's edges meet the triangles. NaN where there are none.
    """
    signs = np.array([(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)])
    rays = np.column_stack([signs * half, np.ones(4)])
    inside: NDArray[np.bool_] = np.all(edges @ rays.T >= 0, axis=1)  # (n, rays)
    corner_positions = np.where(inside[..., np.newaxis], rays[:, :2], np.nan)
    heights = points @ _sides(half).T  # (n, corners, sides), at least 0 inside
    a, b = heights, np.roll(heights, -1, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        fraction = a / (a - b)
    meets = (
        points[:, :, np.newaxis] + fraction[..., np.newaxis] * (np.roll(points, -1, axis=1) - points)[:, :, np.newaxis]
    )
    meets[~((fraction >= 0) & (fraction <= 1))] = np.nan
    candidates = np.concatenate([points, meets.reshape(len(points), -1, 3)], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        positions = candidates[..., :2] / candidates[..., 2:]
        is_seen = (candidates[..., 2] > 0) & (np.abs(positions) <= half * (1 + 1e-9)).all(axis=-1)
    positions = np.concatenate([np.where(is_seen[..., np.newaxis], positions, np.nan), corner_positions], axis=1)
    found = ~np.isnan(positions[..., 0]).all(axis=1)
    low = np.where(np.isnan(positions), np.inf, positions).min(axis=1)
    high = np.where(np.isnan(positions), -np.inf, positions).max(axis=1)
    return np.where(found[:, np.newaxis, np.newaxis], np.stack([low, high], axis=1), np.nan)


def _sides(half: Numbers) -> Numbers:
    """Normals of the sides of the frustum, shape (4, 3): points inside have no negative product with any."""
    return np.array([(sign * (axis == 0), sign * (axis == 1), half[axis]) for axis in (0, 1) for sign in (1.0, -1.0)])


def _in_frustum(a: Numbers, b: Numbers, half: Numbers) -> tuple[Numbers, Numbers]:
    """Fractions at which lines from `a` to `b`, homogeneous, enter and leave the frustum of `half` the size."""
    sides = _sides(half)
    at_start, at_end = a @ sides.T, b @ sides.T
    with np.errstate(divide="ignore", invalid="ignore"):
        fraction = at_start / (at_start - at_end)
    first = np.where((at_start < 0) & (at_end > 0), fraction, 0.0).max(axis=1)
    last = np.where((at_start > 0) & (at_end < 0), fraction, 1.0).min(axis=1)
    last[((at_start <= 0) & (at_end <= 0)).any(axis=1)] = -np.inf
    return first, last


def _pixels_in(rectangles: Numbers, half: Numbers) -> Pixels:
    """Return the first pixels whose centres lie in rectangles (n, 2, 2), and those behind the last; NaN has none."""
    corners = rectangles + (half - 0.5)
    low, high = np.ceil(corners[:, 0], out=corners[:, 0]), np.floor(corners[:, 1], out=corners[:, 1])
    high += 1.0
    # maximum and minimum hand NaN on, fmax and fmin do not: a rectangle of NaN begins where it ends.
    np.fmin(np.maximum(low, 0.0, out=low), 2 * half, out=low)
    np.fmax(np.minimum(high, 2 * half, out=high), 0.0, out=high)
    return corners.astype(np.int32)


def _is_any(pixels: Pixels) -> NDArray[np.bool_]:
    """True where there is a pixel."""
    return (pixels[:, 0, 0] < pixels[:, 1, 0]) & (pixels[:, 0, 1] < pixels[:, 1, 1])


def _inside_picture(
    numbers: Numbers, normals: Numbers, pixels: Pixels, covers: Numbers | None, shape: int, view: _View
) -> Primitives:
    """Return the part inside the picture."""
    kept = _is_any(pixels) & np.isfinite(numbers).all(axis=(1, 2))
    count = int(kept.sum())
    numbers, texels = numbers[kept], np.zeros((count, 9 if view.lit else 6, 4), np.float32)
    texels[:, :3] = numbers
    np.subtract(numbers, texels[:, :3], out=texels[:, 3:6], casting="same_kind")
    if view.lit:
        texels[:, 6:, :3] = normals[kept]
    covers = np.empty((count, 0, 2)) if covers is None else covers[kept]
    return Primitives(texels, pixels[kept], covers, np.full(count, shape, np.int64))


def _power_of_two(rows: Numbers) -> Numbers:
    """Return for each row a power of two that brings its largest number near 1 without loss of digits."""
    largest = np.abs(rows).max(axis=1, initial=0.0)
    return np.ldexp(1.0, -np.frexp(np.where(largest > 0, largest, 1.0))[1])


def _units(vectors: Numbers) -> Numbers:
    """`vectors` at length 1, or 0 where they are."""
    wide = vectors * _power_of_two(vectors)[:, np.newaxis]
    length = np.linalg.norm(wide, axis=1, keepdims=True)
    return np.divide(wide, length, out=np.zeros_like(wide), where=length > 0)
