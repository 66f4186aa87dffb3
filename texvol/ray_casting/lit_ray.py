"""A ray in the world, and the room in which it is worked on, cell by cell."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.compiling import woven_in
from texvol.ray_casting.roots import HIGHEST_DEGREE, ROW, STACK_ROWS

Numbers = NDArray[np.float64]
Triple = tuple[float, float, float]
NODE_COUNT = 5  # see `collocation`
MOST_LEVELS = 200  # halvings in front of deep matter
INTERVAL = 4  # depth and light of a stretch


class Ray(NamedTuple):
    """A ray at distance s from where it is nearest to the centre of the scene's first volume."""

    nearest: Triple  # world, relative to the centre
    direction: Triple
    toward_eye: Triple  # V where the place, and not a sample, is shaded
    eye: float  # s of the eye
    along: float  # depth along the view per s


class Bench(NamedTuple):
    """Scratch arrays of one thread."""

    corners: Numbers  # values of a cell, (8)
    slopes: Numbers  # gradients there, (3, 8)
    channels: Numbers  # emission and extinction there, (4, 8)
    field: Numbers  # value and gradient along the ray, four cubics, (4, 4)
    weight: Numbers  # of the mask along the ray, where there is one, a cubic, (4)
    square: Numbers  # |g|² along the ray, (7)
    polynomial: Numbers  # any other, (7)
    root_stack: Numbers
    cuts: Numbers
    chosen: NDArray[np.int64]  # see `shading`
    glows: Numbers  # emission and extinction at the nodes
    halves: Numbers  # of a stretch, (2, 4)
    stack: Numbers  # stretches not yet done: start, halvings, depth, light


def bench_for(most_cuts: int, most_chosen: int) -> Bench:
    """Room for a scene."""
    return Bench(
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
        glows=np.zeros((NODE_COUNT, 4)),
        halves=np.zeros((2, INTERVAL)),
        stack=np.zeros((MOST_LEVELS + 2, 2 + INTERVAL)),
    )


@woven_in
def position_at(ray, s):
    """World, relative to the centre of the scene's first volume."""
    return (
        ray.nearest[0] + s * ray.direction[0],
        ray.nearest[1] + s * ray.direction[1],
        ray.nearest[2] + s * ray.direction[2],
    )
