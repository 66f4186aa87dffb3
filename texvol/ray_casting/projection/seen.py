"""Rays of a projection, and the light of a surface on them; shared by all projection modes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.rays import Choose, Numbers, Rays, ends_at, middle_of, rays_of, s_of_depth, transformed
from texvol.ray_casting.common.surface_lighting import cued, gradients_at, reflected
from texvol.scene.lighting import Lighting
from texvol.scene.scene import CompleteScene


def seen_rays(scene: CompleteScene, size: tuple[int, int], choose: Choose) -> Rays:
    """Return chosen rays of a picture, up to the depths of a depth picture if there is one."""
    rays = rays_of(scene, *map(choose, scene.camera.rays(size)))
    if scene.depth is None:
        return rays
    return ends_at(rays, s_of_depth(scene.camera, rays, choose(scene.depth.at_size(size))))


def depth_of(scene: CompleteScene, rays: Rays, s: Numbers) -> Numbers:
    """Return the depth of s along the view from the plane of the eye, world units."""
    along_view = scene.volume.world_from_index.T @ scene.camera.forward
    return (s - rays.eye) * (rays.step * along_view).sum(axis=-1)


def lit_color(scene: CompleteScene, rays: Rays, s: Numbers, hit: NDArray[np.bool_], color: Numbers) -> Numbers:
    """Return the light of a surface at s on the rays that hit it, shape (n, 3); `color` is straight, (3) or (n, 3)."""
    volume = scene.volume
    index = rays.start[hit] + s[hit][:, np.newaxis] * rays.step[hit]
    from_centre = transformed(index - middle_of(volume), volume.world_from_index)
    to_eye = -transformed(rays.step[hit], volume.world_from_index)
    gradients = gradients_at(volume, scene.gradient, index)
    diffuse, specular = reflected(scene.lighting or Lighting(), volume, gradients, from_centre, to_eye)
    light = color * diffuse + specular
    if scene.depth_cue is None:
        return light
    with np.errstate(invalid="ignore"):  # rays that hit nothing have no depth
        depth = depth_of(scene, rays, s)[hit]
    return cued(scene.depth_cue, volume, scene.camera, light, depth)
