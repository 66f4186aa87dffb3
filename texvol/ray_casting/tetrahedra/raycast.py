"""The exact ray caster of tetrahedral grids, in float64; see `raycast` for the integral."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.medium import medium_of
from texvol.ray_casting.common.rays import Numbers, over_rows
from texvol.ray_casting.tetrahedra.tracer import Cells, trace_tetrahedra
from texvol.scene.camera import Camera
from texvol.scene.picture_size import AnySize, checked_size
from texvol.scene.tetrahedra import TetrahedralGrid, barycentric_maps
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.color import linear_color
from texvol.util.errors import InputError, check_type

# Of the diagonal of the box. Rays are moved so far, in a direction that is none of a usual grid: a ray in a face or
# along an edge would, by rounding, meet none or several of the tetrahedra there. The value changes by as much of its
# range, and the ray's distance from the face is some ten thousand times the rounding.
_MOVED = 1e-11
_ROWS_AT_ONCE = 8  # of a picture, for one thread, which goes through all tetrahedra for them
_ASIDE = np.array([0.5403023, -0.3178279, 0.7791234])
_MOST_COVERED = 1e-6  # of the diagonal: what several tetrahedra may cover of a ray, by the rounding of positions


def raycast_tetrahedra(
    grid: TetrahedralGrid,
    transfer_function: TransferFunction,
    camera: Camera | None = None,
    size: AnySize = (512, 512),
    *,
    background: Sequence[float] = (0.0, 0.0, 0.0),
) -> NDArray[np.float64]:
    """Return the exact picture of a field on tetrahedra, shape (height, width, 4), to about 1e-9.

    The value on each ray is that of the field itself, linear or constant in each tetrahedron; colour and extinction are
    those of the transfer function at that value, as in the classification `post`. The picture is as that of `raycast`:
    linear and premultiplied, row 0 on top, the background included. Nothing is drawn between tetrahedra, which may be
    apart, and in those with a value that is missing.

    Parameters
    ----------
    grid : TetrahedralGrid
    transfer_function : TransferFunction
    camera : Camera, optional
        By default the box of the grid is framed.
    size : (width, height)
        In pixels; one ray passes through the centre of each.
    background : (r, g, b)
        Linear light behind the grid.

    Raises
    ------
    InputError
        If an argument has another type, the size is not positive, the transfer function needs gradients, or the
        tetrahedra overlap.
    """
    check_type("grid", grid, TetrahedralGrid)
    check_type("transfer_function", transfer_function, TransferFunction)
    size = checked_size(size)
    if transfer_function.needs_gradient:
        raise InputError("transfer_function must not depend on the gradient for tetrahedra")
    light = np.array(linear_color(background, "background"))
    camera = _framing(grid, size) if camera is None else camera
    check_type("camera", camera, Camera)
    picture, covered = _traced(grid, transfer_function, camera, size)
    diagonal = float(np.linalg.norm(grid.extent))
    if covered > _MOST_COVERED * diagonal:
        raise InputError(f"tetrahedra must not overlap, got rays of which several cover a length of {covered:.3g}")
    optical_depth = picture[..., 3].copy()
    picture[..., :3] += np.exp(-optical_depth)[..., np.newaxis] * light
    picture[..., 3] = -np.expm1(-optical_depth)
    return picture


def _framing(grid: TetrahedralGrid, size: tuple[int, int]) -> Camera:
    """Return the camera that frames the box of a grid."""
    extent = np.where(grid.extent > 0, grid.extent, 1.0)
    origin = (grid.low + extent / 4).tolist()
    box = Volume(np.zeros((2, 2, 2), np.uint8), spacing=(extent / 2).tolist(), origin=origin)
    return Camera.framing(box, aspect=size[0] / size[1])


def _traced(
    grid: TetrahedralGrid, transfer: TransferFunction, camera: Camera, size: tuple[int, int]
) -> tuple[Numbers, float]:
    """Return light and optical depth of all rays, and the longest path that several tetrahedra cover."""
    cells, medium = _cells(grid, camera, size), medium_of(transfer)
    eyes, directions = camera.rays(size)
    from_middle = (eyes - grid.low) - grid.extent / 2
    nearest = (from_middle * directions).sum(axis=-1)
    starts = from_middle - nearest[..., np.newaxis] * directions
    starts += _MOVED * np.linalg.norm(grid.extent) * _ASIDE
    picture = np.zeros((size[1], size[0], 4))
    covered = [0.0]

    def trace_rows(rows: slice) -> None:
        covered.append(
            trace_tetrahedra(cells, medium, starts[rows], directions[rows], nearest[rows], rows.start, picture[rows])
        )

    over_rows(trace_rows, picture.shape, pixels_at_once=_ROWS_AT_ONCE * size[0])
    return picture, max(covered)


def _cells(grid: TetrahedralGrid, camera: Camera, size: tuple[int, int]) -> Cells:
    """Return the tetrahedra that have values and may be in the picture."""
    whole = np.flatnonzero(grid.is_whole)
    pixels = _pixels(grid, whole, camera, size)
    seen = (pixels[:, 0] <= pixels[:, 1]) & (pixels[:, 2] <= pixels[:, 3])
    whole, pixels = whole[seen], pixels[seen]
    corners = grid.corners(whole) - grid.extent / 2
    gradients, _ = barycentric_maps(corners)
    first = np.ascontiguousarray(corners[:, 0])
    return Cells(first, np.ascontiguousarray(gradients), np.ascontiguousarray(grid.corner_values(whole)), pixels)


def _pixels(grid: TetrahedralGrid, which: NDArray[np.intp], camera: Camera, size: tuple[int, int]) -> NDArray[np.int64]:
    """Return first and last row and column that tetrahedra may meet, shape (m, 4); the last is smaller if none."""
    width, height = size
    seen = camera.in_eye_space((grid.points - grid.low) - grid.extent / 2, grid.low + grid.extent / 2)
    corners = seen[grid.tetrahedra[which]]
    across, above, depth = np.moveaxis(corners, -1, 0)
    pixel = 2 * camera.half_height / height
    is_near = np.zeros(len(which), np.bool_)
    if camera.projection == "perspective":
        # A tetrahedron that reaches to the plane of the eye may be anywhere in the picture.
        farthest = np.abs(depth).max(axis=1)
        is_near = (depth <= 1e-6 * farthest[:, np.newaxis]).any(axis=1)
        divisor = np.where(is_near[:, np.newaxis], 1.0, depth)
        across, above = across / divisor, above / divisor
    column = across / pixel + (width - 1) / 2
    row = (height - 1) / 2 - above / pixel
    # Rounded outwards, within bounds that are whole numbers of 64 bits.
    ends = np.stack([row.min(axis=1), row.max(axis=1), column.min(axis=1), column.max(axis=1)], axis=1)
    last = np.array([height, height, width, width])
    ends = np.clip(ends, -2, last + 1)
    found = np.stack([np.floor(ends[:, 0]), np.ceil(ends[:, 1]), np.floor(ends[:, 2]), np.ceil(ends[:, 3])], axis=1)
    found[is_near] = (0, height - 1, 0, width - 1)
    found[(depth < 0).all(axis=1)] = (0, -1, 0, -1)
    return np.stack([
        np.maximum(found[:, 0], 0), np.minimum(found[:, 1], height - 1),
        np.maximum(found[:, 2], 0), np.minimum(found[:, 3], width - 1),
    ], axis=1).astype(np.int64)  # fmt: skip
