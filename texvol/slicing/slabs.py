"""View-aligned polygons: where on the screen each slab stack has to be drawn.

Depth along the view is counted in slab thicknesses from the middle of the box: slab k lies between the planes k and
k + 1, whatever the eye does, so that the phase of the slabs is one for the whole volume. A *slab stack* is a run of
slabs drawn by one polygon. Its polygon covers the whole projection of box ∩ stack, silhouettes included, since each
fragment integrates its own path through slab ∩ box; what it covers beyond costs a little time and adds nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.picture_size import shrunk
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

# Ways in which slabs are drawn: many by one polygon; by a polygon each; by a polygon each, and always whole.
Slicing = Literal["stacks", "polygons", "wilson"]
SLICINGS: tuple[Slicing, ...] = get_args(Slicing)
Numbers = NDArray[np.float64]
Corner = tuple[float, float]
_ROWS = 32  # of pixels at a time: few calls, and arrays that stay in a cache
_COUNTED = 128  # rays along a side that an estimate is made from
MOST_SLABS = 1 << 20  # float32 counts slabs exactly to 2^24; a million are hours of drawing
# As many as there may be turns of loops in a fragment (65535 in all in Mesa's software driver), so that hardly a volume
# has more than one stack: where nothing shows behind it a fragment stops, and there is little to blend.
SLABS_PER_STACK = 2048
WHOLE_BOX = np.array([(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)])

_SCREEN = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
BOX_EDGES = np.array([(c, c | 1 << a) for a in range(3) for c in range(8) if not c & 1 << a])  # pairs of corners


@dataclass(frozen=True)
class SlabStacks:
    """Polygons of a view, front to back."""

    polygons: Numbers  # convex, in normalised device coordinates; shape (stacks, corners, 2)
    first: NDArray[np.int64]  # stack s holds the slabs first[s] … last[s] - 1; shape (stacks,)
    last: NDArray[np.int64]
    eye_depth: float  # in slab thicknesses, in the same count
    slab_thickness: float  # world units, plane to plane

    @property
    def slab_count(self) -> int:
        """Number of slabs from the first to the last."""
        return int(self.last[-1] - self.first[0]) if self.last.size else 0


def slab_stacks(
    volume: Volume,
    camera: Camera,
    slab_thickness: float,
    size: tuple[int, int],
    per_stack: int = SLABS_PER_STACK,
    part: Numbers = WHOLE_BOX,
    about: Numbers | None = None,
) -> SlabStacks:
    """Polygons for a part of the volume's box in front of the eye; none if it lies behind it.

    `slab_thickness` is in world units, `size` is (width, height) in pixels. `part` has the low and the high corner of
    the part, in fractions of the box, shape (2, 3). Slab 0 begins at the depth of the world point `about`, the middle
    of the box unless told.
    """
    corners = box_corners(volume, camera, part)[:, :3]
    middle = float(camera.pixel_rays(size, volume.centre if about is None else about).reference_depth)
    with np.errstate(over="ignore"):
        depths = (corners[:, 2] - middle) / slab_thickness
        eye_depth = float(-np.float64(middle) / slab_thickness)
    nearest, farthest = max(depths.min(), eye_depth), depths.max()
    if not farthest > nearest:
        nothing = np.empty(0, np.int64)
        return SlabStacks(np.empty((0, len(_SCREEN), 2)), nothing, nothing, eye_depth, slab_thickness)
    if farthest - nearest > MOST_SLABS:
        raise InputError(
            f"slab thickness {slab_thickness:g} cuts the volume into {farthest - nearest:.3g} slabs; "
            f"at most {MOST_SLABS} can be drawn"
        )
    first = np.arange(int(np.floor(nearest)), int(np.ceil(farthest)), per_stack)
    last = np.minimum(first + per_stack, int(np.ceil(farthest)))
    near = middle + slab_thickness * np.maximum(first, nearest)
    far = middle + slab_thickness * np.minimum(last, farthest)
    polygons = _covering_polygons(*_box_between(corners, near, far), camera, size)
    return SlabStacks(polygons, first, last, eye_depth, slab_thickness)


def slabs_crossed_about(volume: Volume, camera: Camera, slab_thickness: float, size: tuple[int, int]) -> float:
    """Estimate `slabs_crossed` from at most `_COUNTED` rays along each side, for a picture that may be huge."""
    few = shrunk(size, _COUNTED)
    return slabs_crossed(volume, camera, slab_thickness, few) * (size[0] * size[1]) / (few[0] * few[1])


def slabs_crossed(volume: Volume, camera: Camera, slab_thickness: float, size: tuple[int, int]) -> int:
    """Total number of slabs that the rays of a picture cross in the box, in front of the eye."""
    rays = camera.pixel_rays(size, volume.centre)
    box_from_world = volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]
    of_points, of_velocities = (
        [box_from_world @ each for each in (first, per_column, per_row)]
        for first, per_column, per_row in (
            (rays.point, rays.point_per_column, rays.point_per_row),
            (rays.velocity, rays.velocity_per_column, rays.velocity_per_row),
        )
    )
    x = np.arange(size[0]) - (size[0] - 1) / 2
    total = 0
    for first in range(0, size[1], _ROWS):
        y = (np.arange(first, min(first + _ROWS, size[1])) - (size[1] - 1) / 2)[:, np.newaxis]
        enters, leaves = np.float64(-rays.reference_depth / slab_thickness), np.float64(np.inf)
        for axis in range(3):
            position, direction = (
                each[0][axis] + x * each[1][axis] + y * each[2][axis] for each in (of_points, of_velocities)
            )
            direction *= slab_thickness
            direction[np.abs(direction) < 1e-30] = 1e-30
            near, far = (-0.5 - position) / direction, (0.5 - position) / direction
            enters, leaves = np.maximum(enters, np.minimum(near, far)), np.minimum(leaves, np.maximum(near, far))
        total += int((np.ceil(leaves) - np.floor(enters))[enters < leaves].sum())
    return total


def box_corners(volume: Volume, camera: Camera, part: Numbers = WHOLE_BOX) -> Numbers:
    """Corners of a part of the box, shape (8, 6): right, up and depth in eye space, and fractions of the box."""
    bits = (np.arange(8)[:, np.newaxis] >> np.arange(3)) & 1
    in_box = np.take_along_axis(part, bits, axis=0)
    in_eye_space = camera.in_eye_space((in_box - 0.5) @ volume.box_edges.T, volume.centre)
    return np.concatenate([in_eye_space, in_box], axis=1)


def _box_between(corners: Numbers, near: Numbers, far: Numbers) -> tuple[Numbers, NDArray[np.bool_]]:
    """Eye-space points whose convex hull is the box between each pair of depths, and which of them exist.

    The points are the corners between the planes and the positions where an edge meets a plane: (stacks, 32, 3).
    """
    a, b = corners[BOX_EDGES[:, 0]], corners[BOX_EDGES[:, 1]]
    planes = np.concatenate([near[:, np.newaxis], far[:, np.newaxis]], axis=1)  # (stacks, 2)
    rise = b[:, 2] - a[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        fraction = (planes[:, :, np.newaxis] - a[:, 2]) / rise  # (stacks, 2, edges)
    crosses = (fraction >= 0) & (fraction <= 1)
    fraction = np.where(crosses, fraction, 0.0)
    crossings = a + fraction[..., np.newaxis] * (b - a)
    between = (corners[:, 2] >= near[:, np.newaxis]) & (corners[:, 2] <= far[:, np.newaxis])
    stacks = near.size
    points = np.concatenate([np.broadcast_to(corners, (stacks, 8, 3)), crossings.reshape(stacks, -1, 3)], axis=1)
    return points, np.concatenate([between, crosses.reshape(stacks, -1)], axis=1)


def _covering_polygons(points: Numbers, exists: NDArray[np.bool_], camera: Camera, size: tuple[int, int]) -> Numbers:
    """Return for each set of points the convex hull of its projection and a margin of a pixel around.

    A polygon of fewer corners than others has its last one several times. Where a point comes close to the plane of
    the eye, the polygon is the whole screen.
    """
    half_size = np.array(size) / 2
    scale = half_size[1] / camera.half_height  # pixels per world unit, at depth 1 in perspective
    depth = points[..., 2:]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        pixels = points[..., :2] * (scale / depth if camera.projection == "perspective" else scale)
    # Beyond 64 screens float32 has too few digits left on the screen itself.
    is_near = (np.abs(pixels) < 64 * half_size).all(axis=2)
    if camera.projection == "perspective":
        is_near &= points[..., 2] > 0
    has_hull = exists.any(axis=1) & (is_near | ~exists).all(axis=1)  # rounding may take every point from a sliver
    stacks = zip(pixels, exists, has_hull, strict=True)
    hulls = [_hull_and_pixel(every[each]) / half_size if known else _SCREEN for every, each, known in stacks]
    most = max(len(hull) for hull in hulls)
    return np.stack([np.concatenate([hull, hull[-1:].repeat(most - len(hull), axis=0)]) for hull in hulls])


def _hull_and_pixel(points: Numbers) -> Numbers:
    """Convex hull of points (n, 2) and all that is within a pixel of them along either axis, anticlockwise.

    Drivers snap corners to 1/256 pixel, and a silhouette that is lost by that shows in full.
    """
    hull = convex_hull((x, y) for x, y in points.tolist())
    return np.array(convex_hull([(x + right, y + up) for x, y in hull for right in (-1.0, 1.0) for up in (-1.0, 1.0)]))


def convex_hull(points: Iterable[Corner]) -> list[Corner]:
    """Convex hull of points, anticlockwise (monotone chain; Andrew 1979)."""
    ordered = sorted(points)
    hull: list[Corner] = []
    for side in (ordered, ordered[::-1]):
        chain: list[Corner] = []
        for x, y in side:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-2:]
                if (bx - ax) * (y - ay) > (by - ay) * (x - ax):
                    break
                chain.pop()
            chain.append((x, y))
        hull += chain[:-1]
    return hull or ordered[:1]
