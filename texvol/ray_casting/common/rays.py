"""Rays of a scene in index space, found so that neither a far eye nor a far origin costs digits."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.bernstein import EPSILON
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.kept_arrays import read_only

Numbers = NDArray[np.float64]
Choose = Callable[[Numbers], Numbers]  # from an array of all pixels, the rows of the requested pixels
PIXELS_AT_ONCE = 1024  # that one thread traces at a time; Ctrl-C waits for no more than these
_PARTS_OF_EACH = 4  # core, at least, of a picture of few pixels
# What holds the values of a type as exactly as the kernels do, which compute in double precision.
_WIDE = dict.fromkeys(("int32", "uint32", "int64", "uint64"), "float64")
_COMPUTED_IN = {"int8": "int16", "float16": "float32"} | _WIDE


class Rays(NamedTuple):
    """Rays `start` + s `step` in the index space of the scene's first volume; shapes (rows, columns, …).

    s is in world units, and 0 where the ray is nearest to the centre of that volume's box.
    """

    start: Numbers  # index, (…, 3)
    step: Numbers  # index per world unit, (…, 3)
    eye: Numbers  # s of the eye, (…)
    ends: Numbers  # first and last s that are seen, (…, 2)
    direction: Numbers  # unit vectors, world, (…, 3)


Trace = Callable[[Rays, Numbers], None]  # adds light and, in the last channel, optical depth to a picture of zeros


class Values(NamedTuple):
    """Values of a volume, (z, y, x), in the type that they have: the other arrays are empty.

    One type for all, since a kernel takes seconds to compile.
    """

    shape: tuple[int, int, int]
    float32: NDArray
    uint8: NDArray
    int16: NDArray
    uint16: NDArray
    float64: NDArray


def values_of(volume: Volume) -> Values:
    """Return the values for compiled code."""
    values = volume.values
    name = values.dtype.name
    if name in _COMPUTED_IN:
        name = _COMPUTED_IN[name]
        values = values.astype(name)
    nz, ny, nx = values.shape
    arrays = (read_only(values if kind == name else np.zeros((0, 0, 0), kind)) for kind in Values._fields[1:])
    return Values((nz, ny, nx), *arrays)


def rays_of(scene: Scene, eyes: Numbers, directions: Numbers) -> Rays:
    """Return the rays from `eyes` in unit `directions`, both of shape (rows, columns, 3) in world units."""
    volume = scene.volume
    from_centre = eyes - volume.centre
    eye = (from_centre * directions).sum(axis=-1)
    nearest = from_centre - eye[..., np.newaxis] * directions
    to_index = volume.index_from_world
    first, last = scene.cutting.interval(volume, nearest, directions)
    ends = np.stack([np.maximum(first, eye), last], axis=-1)
    start = transformed(nearest, to_index) + middle_of(volume)
    return Rays(start, transformed(directions, to_index), eye, ends, directions)


def s_of_depth(camera: Camera, rays: Rays, depths: Numbers) -> Numbers:
    """Return the s of depths along the view from the plane of the eye, both of shape (rows, columns)."""
    return rays.eye + depths / (rays.direction * camera.forward).sum(axis=-1)


def ends_at(rays: Rays, until: Numbers) -> Rays:
    """Return the rays, of which nothing is seen behind the s `until`."""
    return rays._replace(ends=np.stack([rays.ends[..., 0], np.minimum(rays.ends[..., 1], until)], axis=-1))


def position_rounding(volume: Volume, eye: tuple[float, float, float] | Numbers) -> Numbers:
    """Return how far rounding may move a ray along each axis, in index space: a few ulps of the largest coordinate.

    The bound counts only where the picture jumps: a ray as near as this to a face counts as a ray in the face.
    """
    reach = np.abs(eye) + np.abs(volume.centre) + np.abs(volume.box_edges).sum(axis=1)
    ulps = EPSILON * (np.abs(volume.index_from_world) @ reach + np.array(volume.dimensions))
    return np.minimum(16 * ulps, 1e-6)


def middle_of(volume: Volume) -> Numbers:
    """Return the index (x, y, z) of the volume's centre."""
    return (np.array(volume.dimensions) - 1) / 2


def centre_from(first: Volume, volume: Volume) -> Numbers:
    """Return the centre of a volume relative to the centre of `first`, in world units.

    It is not the difference of the two world positions, which has few digits far from the world's origin.
    """
    own, other = (each.world_from_index @ middle_of(each) for each in (volume, first))
    return (volume.origin - first.origin) + (own - other)


def rays_in(volume: Volume, first: Volume, nearest: Numbers, directions: Numbers) -> tuple[Numbers, Numbers]:
    """Return starts and steps, in a volume's index space, of rays centre of `first` + `nearest` + s `directions`."""
    to_index = volume.index_from_world
    start = transformed(nearest - centre_from(first, volume), to_index) + middle_of(volume)
    return start, transformed(directions, to_index)


def transformed(vectors: Numbers, matrix: Numbers) -> Numbers:
    """Return `matrix` times vectors, shape (…, 3), rounded alike in an array of any shape.

    A matrix product of many vectors may be rounded otherwise than that of a few.
    """
    x, y, z = (vectors[..., axis, np.newaxis] * matrix[:, axis] for axis in range(3))
    return x + y + z


def over_rows(
    trace_rows: Callable[[slice], None],
    shape: tuple[int, ...],
    tell: Callable[[float], None] = lambda fraction: None,
    *,
    pixels_at_once: int = PIXELS_AT_ONCE,
) -> None:
    """Call `trace_rows` for all rows of a picture, a few rows at a time, in threads; `tell` what fraction is done.

    `shape` begins with the numbers of rows and columns; `pixels_at_once` are the most that one call traces.
    """
    height, width = shape[:2]
    cores = os.cpu_count() or 1
    # A list of pixels is a picture of one column: eight of these would take less time than to begin with them.
    rows = max(min(pixels_at_once // max(width, 1), -(-height // (_PARTS_OF_EACH * cores))), 1)
    threads = ThreadPoolExecutor(cores)
    try:
        parts = [slice(row, min(row + rows, height)) for row in range(0, height, rows)]
        for part, _ in zip(parts, threads.map(trace_rows, parts), strict=True):
            tell(part.stop / height)
    finally:
        threads.shutdown(cancel_futures=True)
