"""Isosurface of a volume, as a mesh or as points, by one of several methods.

The surface is that of mode isosurface: as the field, it extends half a spacing beyond the outermost samples, constant
and open (only `contours` closes it there); there is no surface in cells beside missing samples. A sample that has the
value itself counts as below it.
"""

from __future__ import annotations

from importlib import import_module
from typing import Literal, get_args, overload

import numpy as np
from numpy.typing import NDArray

from texvol.geometry.points import Points
from texvol.geometry.surfaces.field import Facets, Field, field_of
from texvol.scene.shapes import Mesh
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.suggestions import check_one_of

MeshMethod = Literal["marching-cubes", "marching-tetrahedra", "cuberille", "contours"]
SurfaceMethod = Literal[MeshMethod, "dividing-cubes"]
METHODS: tuple[SurfaceMethod, ...] = get_args(SurfaceMethod)


@overload
def surface_of(volume: Volume, value: float, method: MeshMethod = ...) -> Mesh: ...
@overload
def surface_of(
    volume: Volume, value: float, method: Literal["dividing-cubes"], *, cell_size: float | None = ...
) -> Points: ...
@overload
def surface_of(
    volume: Volume, value: float, method: SurfaceMethod, *, cell_size: float | None = ...
) -> Mesh | Points: ...
def surface_of(
    volume: Volume, value: float, method: SurfaceMethod = "marching-cubes", *, cell_size: float | None = None
) -> Mesh | Points:
    """Return the surface on which a volume has a value, in world units.

    Triangles are counter-clockwise seen from the side of lower values, and normals point there, also on mirrored grids.
    Methods are described in `texvol.geometry.surfaces`; "dividing-cubes" returns points, the others a mesh.

    Parameters
    ----------
    cell_size : float, optional
        Of "dividing-cubes": largest side of the parts of cells that become points, world units; half the smallest
        spacing unless told.

    Raises
    ------
    InputError
        If the value is not finite, or the volume does not contain it; if the method is unknown, or `cell_size` is not
        for it; if samples are missing, for "contours".
    MissingExtraError
        If scikit-image is not installed, for "marching-cubes" and "contours".
    """
    check_one_of("method", method, METHODS)
    if cell_size is not None and method != "dividing-cubes":
        raise InputError(f"cell_size is for method dividing-cubes only, got method {method}")
    field = checked_field(volume, value)
    name = f"{volume.name} at {value:g}"
    if method == "dividing-cubes":
        from texvol.geometry.surfaces.dividing_cubes import dividing_cubes

        points, normals = dividing_cubes(field, cell_size)
        _check_any(len(points), volume, value)
        return Points(_in_world(points, volume), _turned(normals, volume), name)
    function = method.replace("-", "_")
    found: Facets = getattr(import_module(f"texvol.geometry.surfaces.{function}"), function)(field)
    _check_any(len(found.triangles), volume, value)
    return _mesh(found, volume, name)


def ambiguous_cell_count(volume: Volume, value: float) -> int:
    """Return the number of cells with an ambiguous face at a value, see `surfaces.ambiguity`.

    Raises
    ------
    InputError
        If the value is not finite, or the volume does not contain it.
    """
    from texvol.geometry.surfaces.ambiguity import ambiguous_cells

    return int(ambiguous_cells(checked_field(volume, value)).sum())


def checked_field(volume: Volume, value: float) -> Field:
    """Return the field of a volume relative to a value, or InputError where the volume does not contain it."""
    if not np.isfinite(value):
        raise InputError(f"{volume.name}: the value of a surface must be finite, got {value!r}")
    low, high = volume.value_range or (np.nan, np.nan)
    if not low <= value <= high:
        held = "all are missing" if np.isnan(low) else f"they go from {low:g} to {high:g}"
        raise InputError(f"{volume.name}: no surface, since no value is {value:g}: {held}")
    return field_of(volume, value)


def _mesh(found: Facets, volume: Volume, name: str) -> Mesh:
    """Return facets of index space in the world; a left-handed grid mirrors them once."""
    is_mirrored = np.linalg.det(volume.direction) < 0
    return Mesh(
        _in_world(found.vertices, volume),
        found.triangles[:, ::-1] if is_mirrored else found.triangles,
        normals=None if found.normals is None else _turned(found.normals, volume),
        name=name,
    )


def _check_any(count: int, volume: Volume, value: float) -> None:
    if not count:
        raise InputError(f"{volume.name}: no surface, since only single samples are {value:g}")


def _in_world(index: NDArray[np.float64], volume: Volume) -> NDArray[np.float64]:
    return np.asarray(volume.origin + index @ volume.world_from_index.T)


def _turned(normals: NDArray[np.float64], volume: Volume) -> NDArray[np.float64]:
    """Return unit normals in the world from gradients in index space."""
    scaled = volume.index_from_world * volume.smallest_spacing
    turned = normals @ scaled
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    return np.divide(turned, length, out=np.zeros_like(turned), where=length > 0)
