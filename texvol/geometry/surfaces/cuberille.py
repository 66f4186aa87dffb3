"""Cuberille (Herman, Liu 1979): the faces between voxels above the isovalue and voxels that are not.

A voxel is the box around a sample, half a spacing to each side. Vertices are shared. Where two voxels touch along an
edge only, four faces meet there: the mesh stays closed, as many triangles run along the edge either way, but the edge
is in four of them. It is not split, since nothing in the samples says which faces belong together. Voxels that touch at
a corner share that vertex.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.geometry.surfaces.field import Facets, Field


def cuberille(field: Field) -> Facets:
    """Return the surface, open at the box and beside missing samples; without normals, since facets are flat."""
    inner = (slice(1, -1),) * 3
    inside = field.decided[inner] > 0
    missing = None if field.missing is None else field.missing[inner]
    corners_shape = tuple(count + 1 for count in inside.shape)
    faces = np.concatenate([_faces(inside, missing, axis, corners_shape) for axis in range(3)])
    triangles = faces[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    used, triangles = np.unique(triangles, return_inverse=True)
    vertices = np.stack(np.unravel_index(used, corners_shape)[::-1], axis=1) - 0.5
    return Facets(vertices.astype(np.float64), triangles.reshape(-1, 3))


def _faces(
    inside: NDArray[np.bool_], missing: NDArray[np.bool_] | None, axis: int, corners_shape: tuple[int, ...]
) -> NDArray[np.int64]:
    """Return the faces (n, 4) across an axis of the array, as flat numbers of corners of voxels."""
    ahead = tuple(slice(1, None) if each == axis else slice(None) for each in range(3))
    behind = tuple(slice(None, -1) if each == axis else slice(None) for each in range(3))
    differ = inside[ahead] != inside[behind]
    if missing is not None:
        differ &= ~(missing[ahead] | missing[behind])
    at = np.nonzero(differ)
    ends_here = inside[behind][at]
    first = np.ravel_multi_index([each + (number == axis) for number, each in enumerate(at)], corners_shape)
    strides = np.array([corners_shape[1] * corners_shape[2], corners_shape[2], 1])
    # Across x, from y to z is counter-clockwise seen from higher x; the other axes in turn.
    u, v = strides[axis - 1], strides[axis - 2]
    around = first[:, np.newaxis] + np.array([0, u, u + v, v])
    return np.where(ends_here[:, np.newaxis], around, around[:, ::-1])
