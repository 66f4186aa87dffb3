"""Switches and uniforms of light and depth cues; none for a scene without them.

Lights are counted among directions of the world, gradients relative to the largest that a texel may hold, positions
relative to the middle of the box and its radius, so that float32 has digits left in worlds of any size.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.lighting import (
    MOST,
    DepthCue,
    Lighting,
    casts_shadows,
    depends_on_eye,
    lights_of_kind,
    position_of,
    shadow_distance,
    unit,
)
from texvol.scene.volume import Volume

_LEAST = 1e-30  # of what is divided by: its product with MOST and its square are float32s


def light_switches(lighting: Lighting | None) -> dict[str, int]:
    """Switches of light.glsl, and LIT."""
    if lighting is None:
        return {"LIT": 0}
    return {
        "LIT": 1,
        "HEAD_LIGHT": int(bool(lights_of_kind(lighting, "head"))),
        "DIRECTIONAL_LIGHTS": len(lights_of_kind(lighting, "directional")),
        "POINT_LIGHTS": len(lights_of_kind(lighting, "point")),
        "SPECULAR": int(_has_highlights(lighting)),
        "TWO_SIDED": int(lighting.two_sided and bool(lighting.lights)),
        "SHADOWS": int(casts_shadows(lighting)),
    }


def light_uniforms(lighting: Lighting, volume: Volume, largest_gradient: float) -> dict[str, Any]:
    """Uniforms of light.glsl; `largest_gradient` is what a gradient of 1 in the shader stands for, per world unit."""
    uniforms: dict[str, Any] = {"ambient": min(lighting.ambient, MOST)}
    if lighting.lights:
        uniforms["diffuse"] = min(lighting.diffuse, MOST)
        uniforms["fade"] = float(np.clip(lighting.fade_for(volume) / largest_gradient, _LEAST, MOST))
    if _has_highlights(lighting):
        uniforms |= {"specular": min(lighting.specular, MOST), "shininess": min(lighting.shininess, MOST)}
    if heads := lights_of_kind(lighting, "head"):
        uniforms["head_color"] = _array([np.sum([light.color for light in heads], axis=0)])[0]
    if directional := lights_of_kind(lighting, "directional"):
        uniforms["directions"] = _array([unit(light.vector) for light in directional if light.vector])
        uniforms["direction_colors"] = _array([light.color for light in directional])
    if points := lights_of_kind(lighting, "point"):
        uniforms["positions"] = _array([position_of(light, volume) / volume.radius for light in points])
        uniforms["position_colors"] = _array([light.color for light in points])
    if points or casts_shadows(lighting):
        to_position, to_box = box_matrices(volume)
        uniforms["world_from_box"] = tuple(to_position.T.reshape(-1))  # column after column
        uniforms["world_corner"] = tuple(to_position @ np.full(3, -0.5))
    if casts_shadows(lighting):
        uniforms["box_from_position"] = tuple(to_box.T.reshape(-1))
        uniforms["shadow_distance"] = shadow_distance(volume) / volume.radius
    return uniforms


def box_matrices(volume: Volume) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """From fractions of the box to positions in units of its radius, both from its middle, and back; shape (3, 3)."""
    to_position = volume.box_edges / volume.radius
    return to_position, volume.index_from_world * volume.radius / np.array(volume.dimensions)[:, np.newaxis]


def eye_uniforms(lighting: Lighting, camera: Camera, size: tuple[int, int]) -> dict[str, Any]:
    """Uniforms of the direction to the eye for each pixel; none if the light looks the same from everywhere."""
    if not depends_on_eye(lighting):
        return {}
    rays = camera.pixel_rays(size, np.zeros(3))
    uniforms: dict[str, Any] = {"to_eye_middle": tuple(-rays.velocity)}
    if camera.projection == "perspective":
        uniforms["to_eye_per_column"] = tuple(-rays.velocity_per_column)
        uniforms["to_eye_per_row"] = tuple(-rays.velocity_per_row)
    return uniforms


def cue_uniforms(
    cue: DepthCue, volume: Volume, camera: Camera, slab_thickness: float, about: NDArray[np.float64]
) -> dict[str, Any]:
    """A depth cue, with depth in slab thicknesses from the world point `about`."""
    near, far = cue.range_for(volume, camera)
    middle = float(camera.forward @ (about - camera.eye))
    return {
        "cue": _array([(*cue.color, cue.strength)])[0],
        "cue_range": _array([((middle - near) / (far - near), slab_thickness / (far - near))])[0],
    }


def _has_highlights(lighting: Lighting) -> bool:
    return lighting.specular > 0 and bool(lighting.lights)


def _array(rows: Iterable[Any]) -> list[tuple[float, ...]]:
    return [tuple(map(float, np.clip(row, -MOST, MOST))) for row in rows]
