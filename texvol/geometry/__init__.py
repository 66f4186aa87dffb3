"""Geometry that stands in a volume: triangle meshes and lines, opaque or translucent, to be put into `Scene.geometry`.

    Mesh, Lines         what there is
    load_mesh           from PLY, STL, OBJ or VTP
    save_mesh           to them
    surface_of          the isosurface of a volume, as a mesh

A surface has a colour and an opacity, and no thickness: a ray goes through matter up to it, then through the surface,
then through matter again. Only the ray through the middle of a pixel counts, as for matter; edges are not smoothed.
Surfaces at one depth are met in the order of the scene. They cast no shadows and none falls on them.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from texvol.scene.shapes import Lines, Mesh

if TYPE_CHECKING:
    from texvol.scene.volume import Volume

__all__ = ["Lines", "Mesh", "load_mesh", "save_mesh", "surface_of"]


def load_mesh(
    path: str | os.PathLike[str],
    *,
    color: tuple[float, float, float] | None = None,
    opacity: float = 1.0,
    lit: bool = True,
) -> Mesh:
    """The mesh that a PLY, STL, OBJ or VTP file holds, named after it; see `reading`."""
    from texvol.geometry import reading

    return reading.load_mesh(path, color=color, opacity=opacity, lit=lit)


def save_mesh(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write a mesh as PLY, STL, OBJ or VTP, whole or not at all; see `saving`."""
    from texvol.geometry import saving

    saving.save_mesh(mesh, path)


def surface_of(volume: Volume, value: float) -> Mesh:
    """The isosurface of a volume as a mesh; see `extraction`."""
    from texvol.geometry import extraction

    return extraction.surface_of(volume, value)
