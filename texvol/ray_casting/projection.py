"""The oracle of the projection modes: what the value is along each ray, without a step length, in float64.

    xray        ∫ v ds, or what of it is   average    ∫ v ds / ∫ ds
                above air, see `texvol.scene.air`
    mip, minip  the highest, lowest v      isosurface the first place where v is or passes the isovalue, lit

The value v is trilinear, so a cubic in s between two faces of cells: its integral has a closed form, it is highest at
an end or where it turns, and between two turns it meets a value once: a surface's, or that of air, at which its
integral is cut. NaN is no value and no way. A cell in which an infinite sample has weight is infinite throughout, as
for the post-classified oracle. What a mask hides is NaN.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.projection_shading import answer, gradients_at
from texvol.ray_casting.projection_walk import ABOVE, HIGHEST, INTEGRAL, SURFACE, project_rays
from texvol.scene.air import attenuation_of
from texvol.scene.camera import Camera
from texvol.scene.display import isosurface_color
from texvol.scene.lighting import Lighting
from texvol.scene.scene import Scene, checked_size
from texvol.util.errors import InputError
from texvol.util.kept_arrays import read_only

_KINDS = {
    "xray": (INTEGRAL, 1.0),
    "average": (INTEGRAL, 1.0),
    "mip": (HIGHEST, 1.0),
    "minip": (HIGHEST, -1.0),  # the lowest value is the highest of all with the other sign
    "isosurface": (SURFACE, 1.0),
}


Chosen = Callable[[NDArray[np.float64]], NDArray[np.float64]]  # rows of the pixels that are wanted


class _Rays(NamedTuple):
    """Rays as `start` + s `step` in index space; s in world units, 0 where the ray is nearest to the centre."""

    start: NDArray[np.float64]
    step: NDArray[np.float64]
    eye: NDArray[np.float64]  # s of the eye
    ends: NDArray[np.float64]  # s from which and up to which it is seen


def project(
    scene: Scene, size: tuple[int, int] = (512, 512), chosen: Chosen = lambda of_all: of_all
) -> NDArray[np.float64]:
    """Picture of shape (height, width, 4), row 0 on top, of any mode but composite; or rows of chosen pixels.

    For xray, mip, minip and average R, G and B hold the number itself, in data units (times world units for xray), and
    A is 1; all are 0 where the ray meets no value. An infinite and a minus infinite stretch together make NaN. For
    isosurface it is linear and premultiplied: the lit surface, opaque, before the background.

    Raises
    ------
    InputError
        If the mode is composite, or the size is not at least one pixel each way.
    """
    size = checked_size(size)
    scene = scene.completed(size)
    assert scene.camera is not None
    camera = scene.camera
    rays, numbers = _traced(scene, camera, size, chosen)
    number, direction = numbers[..., 0], numbers[..., 1]
    if scene.mode == "isosurface":
        picture = _surface_picture(scene, camera, rays, number, direction >= 0)
        if scene.geometry:
            from texvol.ray_casting.surfaces import Layer, put_before, surface_layers

            until = np.where(direction >= 0, number, np.inf)
            layers = surface_layers(scene, camera, size)
            put_before([Layer(chosen(layer.s), chosen(layer.color)) for layer in layers], until, picture)
        return picture
    if (attenuation := attenuation_of(scene.air)) is not None:
        number = attenuation.per_value * number
    if scene.mode == "average":
        number = np.divide(number, direction, out=np.zeros_like(number), where=direction > 0)
    picture = np.zeros((*direction.shape, 4))
    picture[direction > 0, :3] = (_KINDS[scene.mode][1] * number[direction > 0])[:, np.newaxis]
    picture[direction > 0, 3] = 1.0
    return picture


def isosurface_depth(scene: Scene, size: tuple[int, int] = (512, 512)) -> NDArray[np.float64]:
    """Depth of the isosurface, shape (height, width): along the view, from the plane of the eye, in world units.

    Infinite where a ray meets none.

    Raises
    ------
    InputError
        If the mode is not isosurface, or the size is not at least one pixel each way.
    """
    if scene.mode != "isosurface":
        raise InputError(f"a depth is that of an isosurface, and the mode is {scene.mode}")
    size = checked_size(size)
    scene = scene.completed(size)
    assert scene.camera is not None
    camera = scene.camera
    rays, numbers = _traced(scene, camera, size, lambda of_all: of_all)
    return np.where(numbers[..., 1] >= 0, _depth(scene, camera, rays, numbers[..., 0]), np.inf)


def _traced(scene: Scene, camera: Camera, size: tuple[int, int], chosen: Chosen) -> tuple[_Rays, NDArray[np.float64]]:
    """The rays of a picture, and what `project_rays` finds along each, shape (height, width, 2)."""
    from texvol.ray_casting.raycast import _position_rounding, over_rows, rays_of

    if scene.mode not in _KINDS:
        raise InputError(f"a projection mode is one of {', '.join(_KINDS)}, and not {scene.mode}")
    kind, sign = _KINDS[scene.mode]
    volume = scene.volume
    values = read_only(volume.values.astype(np.float32)) if volume.values.dtype == np.float16 else volume.values
    rays = _Rays(*rays_of(scene, *map(chosen, camera.rays(size))))
    rounding = _position_rounding(volume, camera.eye)
    level = 0.0 if scene.isovalue is None else float(scene.isovalue)
    if (attenuation := attenuation_of(scene.air)) is not None:
        kind, level = ABOVE, attenuation.air
    numbers = np.empty((*rays.eye.shape, 2))

    def trace_rows(rows: slice) -> None:
        start, step, ends = rays.start[rows], rays.step[rows], rays.ends[rows]
        project_rays(values, kind, sign, level, start, step, ends, rounding, numbers[rows])

    over_rows(trace_rows, len(numbers))
    return rays, numbers


def _depth(scene: Scene, camera: Camera, rays: _Rays, s: NDArray[np.float64]) -> NDArray[np.float64]:
    along_view = scene.volume.world_from_index.T @ camera.forward
    return (s - rays.eye) * (rays.step @ along_view)


def _surface_picture(
    scene: Scene, camera: Camera, rays: _Rays, s: NDArray[np.float64], hit: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """The lit surface, opaque, before the background."""
    picture = np.zeros((*hit.shape, 4))
    picture[..., :3] = scene.background
    picture[hit] = 1.0
    if not hit.any():
        return picture
    volume = scene.volume
    index = rays.start[hit] + s[hit][:, np.newaxis] * rays.step[hit]
    from_centre = (index - (np.array(volume.dimensions) - 1) / 2) @ volume.world_from_index.T
    to_eye = -rays.step[hit] @ volume.world_from_index.T
    gradients = gradients_at(volume, scene.gradient, index)
    diffuse, specular = answer(scene.lighting or Lighting(), volume, gradients, from_centre, to_eye)
    color = isosurface_color(scene) * diffuse + specular
    cue = scene.depth_cue
    if cue is not None:
        near, far = cue.range_for(volume, camera)
        depth = _depth(scene, camera, rays, s)[hit][:, np.newaxis]
        t = cue.strength * np.clip((depth - near) / (far - near), 0, 1)
        color = color * (1 - t) + t * np.array(cue.color)
    picture[hit, :3] = color
    return picture
