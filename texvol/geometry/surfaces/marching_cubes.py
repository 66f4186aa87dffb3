"""Marching cubes (Lorensen, Cline 1987) by Lewiner's cases (2003), which keep the topology of the trilinear field.

Vertices are where the value is linear along edges between samples; in between, triangles are flat.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.geometry.surfaces.field import Facets, Field
from texvol.util.errors import missing_extra


def marching_cubes(field: Field) -> Facets:
    """Return the surface by scikit-image, without triangles in cells beside missing samples.

    Raises
    ------
    MissingExtraError
        If scikit-image is not installed.
    """
    try:
        from skimage.measure import marching_cubes as lewiner
    except ImportError as error:
        raise missing_extra("scikit-image", "geometry", "extracting a surface") from error
    try:
        corners, triangles, normals, _ = lewiner(field.above, 0.0, allow_degenerate=False)
    except (RuntimeError, ValueError):
        return Facets(np.empty((0, 3)), np.empty((0, 3), np.int64))
    if field.missing is not None:
        triangles = triangles[~_is_beside(field.missing, corners[triangles].mean(axis=1))]
    used, triangles = np.unique(triangles, return_inverse=True)
    index = corners[used, ::-1].astype(np.float64) - 1  # z, y, x of the padded array
    index = np.clip(index, -0.5, np.array(field.volume.dimensions) - 0.5)
    # Reversing x, y, z mirrors once.
    return Facets(index, triangles.reshape(-1, 3), normals[used, ::-1].astype(np.float64))


def _is_beside(missing: NDArray[np.bool_], positions: NDArray) -> NDArray[np.bool_]:
    """Return True for positions in cells with a missing corner."""
    cells = np.minimum(np.floor(positions).astype(int), np.array(missing.shape) - 2)
    z, y, x = cells.T
    found = np.zeros(len(positions), np.bool_)
    for corner in range(8):
        found |= missing[z + (corner & 1), y + (corner >> 1 & 1), x + (corner >> 2)]
    return found
