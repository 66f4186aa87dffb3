"""Pictures of the projection modes: functions of the value along each ray, without a step length, in float64.

    xray        ∫ v ds, or its part above  average     ∫ v ds / ∫ ds
                air, see `texvol.scene.air`
    mip, minip  highest, lowest v          isosurface  first position where v meets the isovalue, lit

The value v is trilinear, so a cubic in s between two faces of cells: its integral has a closed form, its extremes lie
at the ends or where it turns, and between two turns it meets a value at most once. Parts of a ray on which v is NaN do
not count. A cell in which an infinite sample has weight is infinite throughout, as for the post-classified medium.
Samples that a mask hides are NaN.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.rays import Choose, Numbers, Rays, over_rows, position_rounding, values_of
from texvol.ray_casting.projection.isosurfaces import first_depth, surfaces_picture
from texvol.ray_casting.projection.seen import depth_of, lit_color, seen_rays
from texvol.ray_casting.projection.tracer import ABOVE, HIGHEST, INTEGRAL, SURFACE, project_rays
from texvol.scene.air import attenuation_of
from texvol.scene.display import isosurface_color
from texvol.scene.picture_size import checked_size
from texvol.scene.scene import CompleteScene, Scene
from texvol.util.errors import InputError

_KINDS = {
    "xray": (INTEGRAL, 1.0),
    "average": (INTEGRAL, 1.0),
    "mip": (HIGHEST, 1.0),
    "minip": (HIGHEST, -1.0),  # the lowest value is the highest of the values times -1
    "isosurface": (SURFACE, 1.0),
}


def project(
    scene: Scene,
    size: tuple[int, int] = (512, 512),
    choose: Choose = lambda array: array,
    tell: Callable[[float], None] = lambda fraction: None,
) -> Numbers:
    """Return the picture of a projection mode, shape (height, width, 4), row 0 on top; or rows of chosen pixels.

    In xray, mip, minip and average, R, G and B are the value itself, in data units (times world units for xray), and A
    is 1; all are 0 where a ray meets no value. Parts of infinite and of minus infinite value add up to NaN. For
    isosurface, the picture is linear and premultiplied: the lit surface, opaque, in front of the background.

    Raises
    ------
    InputError
        If the mode is composite, or the size is not at least one pixel in each direction.
    """
    scene.check_size(size := checked_size(size))
    scene = scene.completed(size)
    if scene.isosurfaces:
        return surfaces_picture(scene, size, choose, tell)
    if scene.mode != "isosurface":
        return picture_of_numbers(scene, numbers_along_rays(scene, size, choose, tell))
    rays, numbers = _traced(scene, size, choose, tell)
    number, length = numbers[..., 0], numbers[..., 1]
    picture = _surface_picture(scene, rays, number, length >= 0)
    if scene.geometry:
        from texvol.ray_casting.surfaces.layers import put_before, surface_layers

        behind = rays.ends[..., 1] if scene.depth is not None else np.full(length.shape, np.inf)
        put_before(surface_layers(scene, size, choose), np.where(length >= 0, number, behind), picture)
    return picture


def numbers_along_rays(
    scene: CompleteScene,
    size: tuple[int, int],
    choose: Choose = lambda array: array,
    tell: Callable[[float], None] = lambda fraction: None,
) -> Numbers:
    """Return the numbers that a picture of xray, average, mip or minip is made of, shape (height, width, 2).

    That is the integral, or the highest value (in minip of the values times -1), and the length on which there is a
    value: see `together` for those of the parts of a volume.
    """
    _, numbers = _traced(scene, size, choose, tell)
    if (attenuation := attenuation_of(scene.air)) is not None:
        numbers[..., 0] *= attenuation.per_value
    return numbers


def together(scene: Scene, one: Numbers, other: Numbers) -> Numbers:
    """Return the numbers of rays through two parts of a volume, as `numbers_along_rays` returns those of each."""
    has_one, has_other = one[..., 1] > 0, other[..., 1] > 0
    join = np.maximum if scene.mode in ("mip", "minip") else np.add
    with np.errstate(invalid="ignore"):  # of infinities of both signs there is no sum
        both = join(one[..., 0], other[..., 0])
    number = np.where(has_one & has_other, both, np.where(has_one, one[..., 0], other[..., 0]))
    length = np.where(has_one, one[..., 1], 0.0) + np.where(has_other, other[..., 1], 0.0)
    return np.stack([number, length], axis=-1)


def picture_of_numbers(scene: Scene, numbers: Numbers) -> Numbers:
    """Return the picture of `numbers_along_rays`, shape (height, width, 4)."""
    number, length = numbers[..., 0], numbers[..., 1]
    if scene.mode == "average":
        number = np.divide(number, length, out=np.zeros_like(number), where=length > 0)
    picture = np.zeros((*length.shape, 4))
    picture[length > 0, :3] = (_KINDS[scene.mode][1] * number[length > 0])[:, np.newaxis]
    picture[length > 0, 3] = 1.0
    return picture


def isosurface_depth(scene: Scene, size: tuple[int, int] = (512, 512), choose: Choose = lambda array: array) -> Numbers:
    """Return the depth of the isosurface along the view from the plane of the eye, shape (height, width), world units.

    The depth is infinite where a ray meets no surface. `choose` is as for `project`.

    Raises
    ------
    InputError
        If the mode is not isosurface, or the size is not at least one pixel in each direction.
    """
    if scene.mode != "isosurface":
        raise InputError(f"mode must be isosurface for a depth, got {scene.mode}")
    scene = scene.completed(checked_size(size))
    if scene.isosurfaces:
        return first_depth(scene, size, choose)
    rays, numbers = _traced(scene, size, choose)
    return np.where(numbers[..., 1] >= 0, depth_of(scene, rays, numbers[..., 0]), np.inf)


def _traced(
    scene: CompleteScene, size: tuple[int, int], choose: Choose, tell: Callable[[float], None] = lambda fraction: None
) -> tuple[Rays, Numbers]:
    """Return the rays of a picture, and the numbers of `project_rays` for each, shape (height, width, 2)."""
    if scene.mode not in _KINDS:
        raise InputError(f"mode must be one of {', '.join(_KINDS)} for a projection, got {scene.mode}")
    kind, sign = _KINDS[scene.mode]
    volume = scene.volume
    values, rays = values_of(scene.volume), seen_rays(scene, size, choose)
    rounding = position_rounding(volume, scene.camera.eye)
    level = 0.0 if scene.isovalue is None else float(scene.isovalue)
    if (attenuation := attenuation_of(scene.air)) is not None:
        kind, level = ABOVE, attenuation.air
    numbers = np.empty((*rays.eye.shape, 2))

    def trace_rows(rows: slice) -> None:
        start, step, ends = rays.start[rows], rays.step[rows], rays.ends[rows]
        project_rays(values, kind, sign, level, start, step, ends, rounding, np.empty(8), numbers[rows])

    over_rows(trace_rows, numbers.shape, tell)
    return rays, numbers


def _surface_picture(scene: CompleteScene, rays: Rays, s: Numbers, hit: NDArray[np.bool_]) -> Numbers:
    """Return the lit surface, opaque, in front of the background."""
    picture = np.zeros((*hit.shape, 4))
    picture[..., :3] = scene.background
    picture[hit] = 1.0
    if hit.any():
        assert scene.isovalue is not None
        picture[hit, :3] = lit_color(scene, rays, s, hit, isosurface_color(scene, scene.isovalue))
    return picture
