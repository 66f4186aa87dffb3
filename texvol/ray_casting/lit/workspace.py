"""A ray in the world, and the scratch memory of one thread."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.compiling import woven_in
from texvol.ray_casting.common.rays import Rays
from texvol.ray_casting.lit.roots import HIGHEST_DEGREE, ROW, STACK_ROWS
from texvol.scene.camera import Camera
from texvol.scene.volume import Volume

Numbers = NDArray[np.float64]
Triple = tuple[float, float, float]
NODE_COUNT = 5  # see `collocation`
MOST_LEVELS = 200  # halvings of an interval of large optical depth
INTERVAL = 4  # numbers of an interval: optical depth and light


class Ray(NamedTuple):
    """A ray in world units; s is 0 where the ray is nearest to the centre of the scene's first volume."""

    nearest: Triple  # position at s = 0, relative to that centre
    direction: Triple
    toward_eye: Triple  # V in the formulas of light, for positions on the ray
    eye: float  # s of the eye
    along: float  # depth along the view per unit of s


class Intervals(NamedTuple):
    """Scratch memory of the integral over intervals, see `collocation`."""

    glows: Numbers  # emission and extinction at the nodes, (nodes, 4)
    halves: Numbers  # optical depth and light of the two halves of an interval, (2, 4)
    stack: Numbers  # intervals to be integrated: start, halvings, optical depth, light


class Workspace(NamedTuple):
    """Scratch arrays of one thread."""

    corners: Numbers  # values of a cell, (8)
    slopes: Numbers  # gradients at the corners, (3, 8)
    channels: Numbers  # emission and extinction of the corners, (4, 8)
    field: Numbers  # value and gradient along the ray, four cubics, (4, 4)
    weight: Numbers  # mask along the ray, a cubic, (4)
    square: Numbers  # |g|² along the ray, (7)
    polynomial: Numbers  # polynomial whose roots are wanted, (7)
    root_stack: Numbers
    cuts: Numbers
    chosen: NDArray[np.int64]  # segments of the transfer function, see `shading`
    intervals: Intervals


def workspace_for(most_cuts: int, most_chosen: int) -> Workspace:
    """Return a workspace for a scene of so many cuts in a cell and so many indices in `chosen`."""
    return Workspace(
        corners=np.zeros(8),
        slopes=np.zeros((3, 8)),
        channels=np.zeros((4, 8)),
        field=np.zeros((4, 4)),
        weight=np.ones(4),
        square=np.zeros(HIGHEST_DEGREE + 1),
        polynomial=np.zeros(HIGHEST_DEGREE + 1),
        root_stack=np.zeros((STACK_ROWS, ROW)),
        cuts=np.zeros(most_cuts),
        chosen=np.zeros(most_chosen, np.int64),
        intervals=Intervals(
            np.zeros((NODE_COUNT, 4)), np.zeros((2, INTERVAL)), np.zeros((MOST_LEVELS + 2, 2 + INTERVAL))
        ),
    )


def world_rays(rays: Rays, volume: Volume, middle: Numbers, camera: Camera) -> Numbers:
    """Return the 11 numbers of a `Ray` for each of `rays`; `middle` is the index of the centre of the first volume."""
    nearest = (rays.start - middle) @ volume.world_from_index.T
    along = (rays.direction @ camera.forward)[..., np.newaxis]
    return np.concatenate([nearest, rays.direction, -rays.direction, rays.eye[..., np.newaxis], along], axis=-1)


@woven_in
def position_at(ray, s):
    """Return the position at s, relative to the centre of the scene's first volume, in world units."""
    return (
        ray.nearest[0] + s * ray.direction[0],
        ray.nearest[1] + s * ray.direction[1],
        ray.nearest[2] + s * ray.direction[2],
    )
