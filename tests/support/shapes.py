"""Quads and balls that tests put into volumes, and their pictures in a constant medium, in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from texvol.geometry import Mesh
from texvol.scene.camera import Camera
from texvol.scene.volume import Volume

Numbers = NDArray[np.float64]


class Quad(NamedTuple):
    """A parallelogram, of one colour; its corner and the two edges from there."""

    corner: Numbers
    along: Numbers
    across: Numbers
    color: tuple[float, float, float]
    opacity: float

    def mesh(self, **look: Any) -> Mesh:
        """Two triangles that show their colour, whatever the light."""
        o, u, v = self.corner, self.along, self.across
        return Mesh(
            np.array([o, o + u, o + u + v, o + v]),
            np.array([(0, 1, 2), (0, 2, 3)]),
            self.color,
            self.opacity,
            **({"lit": False} | look),
        )


def quad(
    middle: ArrayLike,
    along: ArrayLike,
    across: ArrayLike,
    color: tuple[float, float, float] = (0.2, 0.7, 0.9),
    opacity: float = 0.4,
) -> Quad:
    """A parallelogram about its middle; the edges are twice the vectors."""
    middle, along, across = (np.asarray(each, np.float64) for each in (middle, along, across))
    return Quad(middle - along - across, 2 * along, 2 * across, color, opacity)


def hits_of(shape: Quad, eyes: Numbers, directions: Numbers) -> Numbers:
    """How far from the eye rays meet a quad, infinite where they miss it or it lies behind."""
    normal = np.cross(shape.along, shape.across)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = ((shape.corner - eyes) @ normal) / (directions @ normal)
        position = eyes + t[..., np.newaxis] * directions - shape.corner
        # Shares of the edges, by Cramer's rule.
        a = np.cross(position, shape.across) @ normal / (normal @ normal)
        b = np.cross(shape.along, position) @ normal / (normal @ normal)
        met = (a > 0) & (a < 1) & (b > 0) & (b < 1) & (t > 0)
    return np.where(met, t, np.inf)


def box_ends(volume: Volume, eyes: Numbers, directions: Numbers) -> tuple[Numbers, Numbers]:
    """How far from the eye rays enter and leave the box, the eye's own place included."""
    unit_from_world = volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]
    position, direction = (eyes - volume.box_corner) @ unit_from_world.T, directions @ unit_from_world.T
    with np.errstate(divide="ignore"):
        a, b = -position / direction, (1 - position) / direction
    first = np.maximum(np.minimum(a, b).max(axis=-1), 0)
    return first, np.maximum(np.maximum(a, b).min(axis=-1), first)


def fog_between(
    color: ArrayLike, extinction: float, ends: tuple[Numbers, Numbers], surfaces: Sequence[tuple[Numbers, ArrayLike]]
) -> Numbers:
    """Picture (height, width, 4) of a constant medium between `ends`, with surfaces at distances, in straight rgba."""
    first, last = ends
    order = np.argsort(np.stack([at for at, _ in surfaces]), axis=0, kind="stable")
    picture = np.zeros((*first.shape, 4))
    here = np.zeros_like(first)

    def behind(rgb: Numbers, alpha: Numbers) -> None:
        left = 1 - picture[..., 3:]
        picture[..., :3] += left * alpha[..., np.newaxis] * rgb
        picture[..., 3:] += left * alpha[..., np.newaxis]

    positions = np.stack([np.broadcast_to(at, first.shape) for at, _ in surfaces])
    looks = np.stack([np.broadcast_to(np.asarray(look, np.float64), (*first.shape, 4)) for _, look in surfaces])
    for rank in [*range(len(surfaces)), None]:
        if rank is None:
            there, look = np.full_like(first, np.inf), np.zeros((*first.shape, 4))
        else:
            there = np.take_along_axis(positions, order[rank : rank + 1], axis=0)[0]
            look = np.take_along_axis(looks, order[rank : rank + 1, ..., np.newaxis], axis=0)[0]
        length = np.maximum(np.minimum(last, there) - np.maximum(first, here), 0)
        behind(np.broadcast_to(np.asarray(color, np.float64), (*first.shape, 3)), -np.expm1(-extinction * length))
        behind(look[..., :3], np.where(np.isfinite(there), look[..., 3], 0.0))
        here = np.maximum(here, np.where(np.isfinite(there), there, np.inf))
    return picture


def quads_in_fog(
    volume: Volume,
    camera: Camera,
    size: tuple[int, int],
    quads: Sequence[Quad],
    color: ArrayLike,
    extinction: float,
) -> Numbers:
    """Picture of a constant medium that fills a volume's box, with quads in and beside it."""
    eyes, directions = camera.rays(size)
    surfaces = [(hits_of(each, eyes, directions), (*each.color, each.opacity)) for each in quads]
    return fog_between(color, extinction, box_ends(volume, eyes, directions), surfaces)


def ball(points: int = 60, seed: int = 0) -> tuple[Numbers, NDArray[np.int64]]:
    """Vertices on the unit sphere and triangles of their convex hull, counter-clockwise seen from outside."""
    random = np.random.default_rng(seed).normal(size=(points, 3))
    vertices = random / np.linalg.norm(random, axis=1, keepdims=True)
    triangles = ConvexHull(vertices).simplices.astype(np.int64)
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    triangles[inward] = triangles[inward, ::-1]
    return vertices, triangles


def globe(rings: int) -> tuple[Numbers, NDArray[np.int64]]:
    """The unit sphere by latitude and longitude: 4 rings (rings - 1) triangles."""
    columns = 2 * rings
    theta, phi = np.meshgrid(np.pi * np.arange(1, rings) / rings, np.pi * np.arange(columns) / rings, indexing="ij")
    around = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    vertices = np.concatenate([[(0.0, 0.0, 1.0)], around.reshape(-1, 3), [(0.0, 0.0, -1.0)]])
    column = np.arange(columns)
    following = (column + 1) % columns
    triangles = [np.stack([0 * column, 1 + column, 1 + following], axis=1)]
    for ring in range(rings - 2):
        a, b = 1 + ring * columns + column, 1 + ring * columns + following
        triangles += [np.stack([a, a + columns, b], axis=1), np.stack([b, a + columns, b + columns], axis=1)]
    last = 1 + (rings - 2) * columns
    triangles.append(np.stack([0 * column + len(vertices) - 1, last + following, last + column], axis=1))
    return vertices, np.concatenate(triangles)
