"""Rays of section 6.1: the frustum in index space, a ray for each pixel by increments, clipped to the box.

The *frustum* (Seixas 1997, algorithm 6.2) is given by its first ray and what the ray changes by from one pixel and one
scanline to the next; the source draws parallel rays, and in perspective their direction changes by increments, too.
*Cyrus-Beck clipping* (Foley 1990, table 6-1) takes the parameter t of a ray at each of the six faces; a face is one
where the ray may enter or one where it may leave, by the sign of its direction there. The ray enters at the largest t
of the former, and leaves at the smallest of the latter.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

Numbers = NDArray[np.float64]
_ROWS_AT_ONCE = 8  # of a picture, for one thread; Ctrl-C waits for no more than these


class Rays(NamedTuple):
    """Rays `start` + t `step` in a volume whose voxel (i, j, k) is the cube from (i, j, k) to (i+1, j+1, k+1).

    t is in world units; a ray is in the box from `near` to `far`, and nowhere if `far` is not larger.
    """

    start: Numbers  # (rows, columns, 3)
    step: Numbers  # (rows, columns, 3)
    near: Numbers  # (rows, columns)
    far: Numbers  # (rows, columns)


def rays_of(camera: Camera, size: tuple[int, int], volume: Volume) -> Rays:
    """Return the rays of a picture of `size` (width, height), clipped to the volume's box and to the eye's side."""
    width, height = size
    frustum = camera.pixel_rays(size, volume.centre)
    i = (np.arange(width) - (width - 1) / 2)[np.newaxis, :, np.newaxis]
    j = ((height - 1) / 2 - np.arange(height))[:, np.newaxis, np.newaxis]
    point = frustum.point + i * frustum.point_per_column + j * frustum.point_per_row
    direction = frustum.velocity + i * frustum.velocity_per_column + j * frustum.velocity_per_row
    length = np.linalg.norm(direction, axis=-1, keepdims=True)  # world units for one of depth
    to_index = volume.index_from_world.T
    count = np.array(volume.dimensions, np.float64)
    start, step = point @ to_index + count / 2, (direction / length) @ to_index
    eye = -frustum.reference_depth * length[..., 0]
    near, far = cyrus_beck(start, step, count)
    return Rays(start, np.ascontiguousarray(np.broadcast_to(step, start.shape)), np.maximum(near, eye), far)


def cyrus_beck(start: Numbers, step: Numbers, count: Numbers) -> tuple[Numbers, Numbers]:
    """Return t at which rays enter and leave the box from 0 to `count` (x, y, z)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (0 - start) / step, (count - start) / step
    enters, leaves = np.minimum(low, high), np.maximum(low, high)
    in_face = np.isnan(enters)  # 0 / 0: a ray in a face never crosses it
    enters[in_face], leaves[in_face] = -np.inf, np.inf
    return enters.max(axis=-1), leaves.min(axis=-1)


def checked_transmittance(least: float) -> float:
    """Return `least`, the transmittance at which a ray ends, or raise InputError unless it is from 0 to below 1."""
    if not 0 <= least < 1:
        raise InputError(f"least_transmittance must be at least 0 and below 1, got {least!r}")
    return least


def in_threads(draw_rows: Callable[[slice], None], height: int) -> None:
    """Call `draw_rows` for all rows of a picture, a few at a time, in as many threads as there are processors."""
    threads = ThreadPoolExecutor()
    try:
        for _ in threads.map(draw_rows, (slice(row, row + _ROWS_AT_ONCE) for row in range(0, height, _ROWS_AT_ONCE))):
            pass
    finally:
        threads.shutdown(cancel_futures=True)
