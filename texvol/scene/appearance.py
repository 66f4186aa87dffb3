"""Light on meshes: like that on an isosurface, from either side, with full gradient confidence."""

from __future__ import annotations

from dataclasses import replace

from texvol.scene.lighting import Lighting
from texvol.scene.scene import Scene
from texvol.scene.shapes import Mesh


def surface_lighting(scene: Scene) -> Lighting | None:
    """The light that falls on the scene's meshes; None where none is lit.

    It is the scene's, or a head light, without shadows: `texvol.scene.lighting` says it of a surface with normal N, on
    the side that the eye sees.
    """
    if not any(isinstance(shape, Mesh) and shape.lit for shape in scene.geometry):
        return None
    return replace(scene.lighting or Lighting(), two_sided=True, fade=0.0, shadows=False)
