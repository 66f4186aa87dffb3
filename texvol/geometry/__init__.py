"""Geometry in a volume: triangle meshes and lines, opaque or translucent, for `Scene.geometry`.

    Mesh, Lines         shapes
    load_mesh           read PLY, STL, OBJ or VTP
    save_mesh           write these formats
    surface_of          the isosurface of a volume, as a mesh or as points, by one of several methods
    euler_number        vertices - edges + triangles of a mesh
    enclosed_volume     content of a closed mesh

A surface has a colour and an opacity, but no thickness: a ray crosses the medium up to it, then the surface, then the
medium behind it. As for the medium, only the ray through the middle of a pixel counts; edges are not smoothed. Surfaces
at one depth are crossed in the order of the scene. They neither cast nor receive shadows.
"""

from __future__ import annotations

from texvol.geometry.extraction import surface_of
from texvol.geometry.measures import enclosed_volume, euler_number
from texvol.geometry.points import Points
from texvol.geometry.reading import load_mesh
from texvol.geometry.saving import save_mesh
from texvol.scene.shapes import Lines, Mesh

__all__ = ["Lines", "Mesh", "Points", "enclosed_volume", "euler_number", "load_mesh", "save_mesh", "surface_of"]
