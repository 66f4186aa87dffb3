"""View-aligned polygons: where on the screen each slab stack has to be drawn.

Depth along the view is counted in slab thicknesses from the middle of the box: slab k lies between the planes k and
k + 1, whatever the eye does, so that the phase of the slabs is one for the whole volume. A *slab stack* is a run of
slabs drawn by one polygon. Its polygon covers the whole projection of box ∩ stack, silhouettes included, since each
fragment integrates its own path through slab ∩ box; what it covers beyond costs a little time and adds nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

Numbers = NDArray[np.float64]
MOST_SLABS = 1 << 20  # float32 counts slabs exactly to 2^24; a million are hours of drawing
# As many as there may be turns of loops in a fragment (65535 in all in Mesa's software driver), so that hardly a volume
# has more than one stack: where nothing shows behind it a fragment stops, and there is little to blend.
SLABS_PER_STACK = 2048
WHOLE_BOX = np.array([(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)])

_SIDES = 16
_ANGLES = 2 * np.pi / _SIDES * np.arange(_SIDES)
_NORMALS = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])  # (2, sides)
# The whole screen as a polygon of as many sides as the others; some of its corners fall together.
_SCREEN = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]).repeat(_SIDES // 4, axis=0)
_BOX_EDGES = np.array([(c, c | 1 << a) for a in range(3) for c in range(8) if not c & 1 << a])  # pairs of corners


@dataclass(frozen=True)
class SlabStacks:
    """Polygons of a view, front to back."""

    polygons: Numbers  # convex, in normalised device coordinates; shape (stacks, sides, 2)
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
    corners = camera.in_eye_space(_corners_from_centre(volume, part), volume.centre)
    middle = float(camera.pixel_rays(size, volume.centre if about is None else about).reference_depth)
    with np.errstate(over="ignore"):
        depths = (corners[:, 2] - middle) / slab_thickness
        eye_depth = float(-np.float64(middle) / slab_thickness)
    nearest, farthest = max(depths.min(), eye_depth), depths.max()
    if not farthest > nearest:
        nothing = np.empty(0, np.int64)
        return SlabStacks(np.empty((0, _SIDES, 2)), nothing, nothing, eye_depth, slab_thickness)
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


def slabs_crossed(volume: Volume, camera: Camera, slab_thickness: float, size: tuple[int, int]) -> int:
    """Total number of slabs that the rays of a picture cross in the box, in front of the eye."""
    rays = camera.pixel_rays(size, volume.centre)
    box_from_world = volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]
    x = (np.arange(size[0]) - (size[0] - 1) / 2)[:, np.newaxis]
    total = 0
    for y in np.arange(size[1]) - (size[1] - 1) / 2:
        position = 0.5 + (rays.point + x * rays.point_per_column + y * rays.point_per_row) @ box_from_world.T
        direction = slab_thickness * (rays.velocity + x * rays.velocity_per_column + y * rays.velocity_per_row)
        direction = direction @ box_from_world.T
        direction = np.where(np.abs(direction) < 1e-30, 1e-30, direction)
        ends = np.stack([-position / direction, (1 - position) / direction])
        enters = np.maximum(ends.min(axis=0).max(axis=1), -rays.reference_depth / slab_thickness)
        leaves = ends.max(axis=0).min(axis=1)
        total += int((np.ceil(leaves) - np.floor(enters))[enters < leaves].sum())
    return total


def _corners_from_centre(volume: Volume, part: Numbers) -> Numbers:
    """The corners of a part of the box, shape (8, 3), relative to the middle of the box."""
    bits = (np.arange(8)[:, np.newaxis] >> np.arange(3)) & 1
    return (np.take_along_axis(part, bits, axis=0) - 0.5) @ volume.box_edges.T


def _box_between(corners: Numbers, near: Numbers, far: Numbers) -> tuple[Numbers, NDArray[np.bool_]]:
    """Eye-space points whose convex hull is the box between each pair of depths, and which of them exist.

    The points are the corners between the planes and the positions where an edge meets a plane: (stacks, 32, 3).
    """
    a, b = corners[_BOX_EDGES[:, 0]], corners[_BOX_EDGES[:, 1]]
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
    """Return for each set of points a convex polygon on the screen that covers its projection and a margin of a pixel.

    Its sides lie at the farthest point in each of 16 directions, so that it has the same number of corners for
    every stack. Where a point comes close to the plane of the eye, the polygon is the whole screen.
    """
    width, height = size
    scale = height / 2 / camera.half_height  # pixels per world unit, at depth 1 in perspective
    depth = points[..., 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = points[..., :2] * (scale / depth if camera.projection == "perspective" else scale)
        distances = pixels @ _NORMALS
    # A pixel of margin: drivers snap corners to 1/256 pixel, and a silhouette lost by that shows in full.
    reach = np.where(exists[..., np.newaxis], distances, -np.inf).max(axis=1) + 1.0
    reach[~exists.any(axis=1)] = np.inf  # a sliver that rounding took every point from
    # Side i and its neighbour i + 1 meet at n_i r_i + t_i (r_{i+1} - r_i cos) / sin, t_i perpendicular to n_i.
    following = np.roll(reach, -1, axis=1)
    step = _ANGLES[1]
    tangents = np.stack([-_NORMALS[1], _NORMALS[0]])
    with np.errstate(invalid="ignore"):
        along = (following - reach * np.cos(step)) / np.sin(step)
        corners = (reach[:, np.newaxis] * _NORMALS + along[:, np.newaxis] * tangents).transpose(0, 2, 1)
    polygons = corners / (width / 2, height / 2)
    # Beyond 64 screens float32 has too few digits left on the screen itself.
    far_off = ~(np.abs(polygons).max(axis=(1, 2)) < 64)
    if camera.projection == "perspective":
        far_off |= (np.where(exists, points[..., 2], np.inf) <= 0).any(axis=1)
    polygons[far_off] = _SCREEN
    return polygons
