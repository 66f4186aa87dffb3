"""Geometry in a volume: triangle meshes and lines, opaque or translucent, for `Scene.geometry`.

    Mesh, Lines         shapes
    load_mesh           read PLY, STL, OBJ or VTP
    save_mesh           write these formats
    surface_of          the isosurface of a volume, as a mesh

A surface has a colour and an opacity, but no thickness: a ray crosses the medium up to it, then the surface, then the
medium behind it. As for the medium, only the ray through the middle of a pixel counts; edges are not smoothed. Surfaces
at one depth are crossed in the order of the scene. They neither cast nor receive shadows.
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
    """Return the mesh of a PLY, STL, OBJ or VTP file, named after the file; see `reading`."""
    from texvol.geometry import reading

    return reading.load_mesh(path, color=color, opacity=opacity, lit=lit)


def save_mesh(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write a mesh as PLY, STL, OBJ or VTP, whole or not at all; see `saving`."""
    from texvol.geometry import saving

    saving.save_mesh(mesh, path)


def surface_of(volume: Volume, value: float) -> Mesh:
    """Return the isosurface of a volume as a mesh; see `extraction`."""
    from texvol.geometry import extraction

    return extraction.surface_of(volume, value)
