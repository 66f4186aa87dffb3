"""Isosurface of a volume as a mesh, by Lewiner's marching cubes (2003), which keep the topology of the field.

The surface is that of mode isosurface: as the field, it extends half a spacing beyond the outermost samples, constant
and open; there is no surface in cells beside missing samples. Vertices are where the value is linear along edges
between samples; in between, triangles are flat, unlike the trilinear field.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.shapes import Mesh
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, missing_extra

# Infinite values become so many ranges of the finite ones; the surface moves towards the finite side by this fraction.
_INFINITE = 2.0**20


def surface_of(volume: Volume, value: float) -> Mesh:
    """Return the surface on which a volume has a value, in world units.

    Triangles are counter-clockwise seen from the side of lower values, and normals point there, also on mirrored grids.

    Raises
    ------
    InputError
        If the value is not finite, or the volume does not contain it.
    MissingExtraError
        If scikit-image is not installed.
    """
    if not np.isfinite(value):
        raise InputError(f"{volume.name}: the value of a surface must be finite, got {value!r}")
    low, high = volume.value_range or (np.nan, np.nan)
    if not low <= value <= high:
        held = "all are missing" if np.isnan(low) else f"they go from {low:g} to {high:g}"
        raise InputError(f"{volume.name}: no surface, since no value is {value:g}: {held}")
    try:
        from skimage.measure import marching_cubes
    except ImportError as error:
        raise missing_extra("scikit-image", "geometry", "extracting a surface") from error
    above, missing = _above(volume, value)
    try:
        corners, triangles, normals, _ = marching_cubes(above, 0.0, allow_degenerate=False)
    except (RuntimeError, ValueError):
        triangles = np.empty((0, 3), np.int64)
    if triangles.size and missing.any():
        triangles = triangles[~_is_beside(missing, corners[triangles].mean(axis=1))]
    if not triangles.size:
        raise InputError(f"{volume.name}: no surface, since only single samples are {value:g}")
    used, triangles = np.unique(triangles, return_inverse=True)
    index = corners[used, ::-1].astype(np.float64) - 1  # z, y, x of the padded array
    index = np.clip(index, -0.5, np.array(volume.dimensions) - 0.5)
    triangles = triangles.reshape(-1, 3)
    # Reversing x, y, z mirrors once; so does a left-handed grid.
    if np.linalg.det(volume.direction) < 0:
        triangles = triangles[:, ::-1]
    return Mesh(
        volume.origin + index @ volume.world_from_index.T,
        triangles,
        normals=_in_world(normals[used, ::-1].astype(np.float64), volume),
        name=f"{volume.name} at {value:g}",
    )


def _above(volume: Volume, value: float) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return samples above the value, as fractions of the range, padded by one; and a mask of missing samples."""
    low, high = volume.finite_range or (value, value)
    scale = max(high - value, value - low) or 1.0
    above = np.empty(volume.values.shape, np.float32)
    for layer, slot in zip(volume.values, above, strict=True):  # by layers: no float64 of all at once
        slot[...] = np.clip((layer.astype(np.float64) - value) / scale, -_INFINITE, _INFINITE)
    missing = np.isnan(above)
    above[missing] = 1.0  # cells beside them are removed later
    return np.pad(above, 1, mode="edge"), np.pad(missing, 1, mode="edge") if missing.any() else missing


def _is_beside(missing: NDArray[np.bool_], positions: NDArray) -> NDArray[np.bool_]:
    """Return True for positions in cells with a missing corner."""
    cells = np.minimum(np.floor(positions).astype(int), np.array(missing.shape) - 2)
    z, y, x = cells.T
    found = np.zeros(len(positions), np.bool_)
    for corner in range(8):
        found |= missing[z + (corner & 1), y + (corner >> 1 & 1), x + (corner >> 2)]
    return found


def _in_world(normals: NDArray[np.float64], volume: Volume) -> NDArray[np.float64]:
    """Return unit normals in the world from gradients in index space."""
    scaled = volume.index_from_world * volume.smallest_spacing
    turned = normals @ scaled
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    return np.divide(turned, length, out=np.zeros_like(turned), where=length > 0)
