"""Choice of the ray caster for a scene of mode composite: `plain`, `lit` or `several`.

`lit` and `several` are imported, and compiled, when the first scene needs them.
"""

from __future__ import annotations

import numpy as np

from texvol.ray_casting.common.rays import Numbers, Trace, position_rounding, rays_of
from texvol.ray_casting.plain import tracer as plain
from texvol.scene.lighting import casts_shadows
from texvol.scene.scene import CompleteScene


def tracer_for(scene: CompleteScene) -> Trace:
    """Return the function that traces rays through the volumes of a scene, without geometry and caps."""
    volume = scene.volume
    if scene.added or scene.mask is not None or volume.labels or volume.colors is not None:
        return _tracer_for_several(scene)
    rounding = position_rounding(volume, scene.camera.eye)
    if scene.lighting is not None or scene.depth_cue is not None or scene.medium.needs_gradient:
        from texvol.ray_casting.lit import tracer as lit

        return lit.tracer(scene, rounding, light_transmittances(scene)[0])
    return plain.tracer(scene, rounding)


def light_transmittances(scene: CompleteScene) -> list[Numbers]:
    """Return, for each volume, the transmittance of the lights that cast shadows, see `lit.shadows`.

    The arrays have the shape (lights, z, y, x) of the nodes in the volume's box. Each volume casts shadows on all.
    """
    from texvol.ray_casting.lit.shadows import NO_LIGHTS, casting_scene, transmittance_at_nodes

    lighting = scene.lighting
    if lighting is None or not casts_shadows(lighting):
        return [NO_LIGHTS for _ in scene.volumes]
    casting = casting_scene(scene)
    trace = tracer_for(casting)

    def depths(origins: Numbers, directions: Numbers) -> Numbers:
        picture = np.zeros((*origins.shape[:2], 4))
        trace(rays_of(casting, origins, np.ascontiguousarray(directions)), picture)
        return picture[..., 3]

    return [transmittance_at_nodes(lighting, volume, depths) for volume in scene.volumes]


def _tracer_for_several(scene: CompleteScene) -> Trace:
    from texvol.ray_casting.several import tracer as several

    # Rays are found from the first volume's centre, which may be far from the other volumes.
    farthest = np.abs(scene.camera.eye) + np.abs(scene.volume.centre)
    rounding = np.stack([position_rounding(volume, farthest) for volume in scene.volumes])
    return several.tracer(scene, rounding, light_transmittances(scene))
