"""Fields of the place in the world on awkward grids, and what tests ask of surfaces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texvol import Volume
from texvol.geometry import Mesh

Numbers = NDArray[np.float64]
Field = Callable[[Numbers], Numbers]
GRIDS = {
    "plain": np.eye(3),
    "mirrored": np.diag([1.0, -1.0, 1.0]),
    "sheared": np.array([[-1, 0.2, 0], [0.1, 1, 0.3], [0, -0.2, 1]]),
    "turned": np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),
}
# Off the symmetry of the grid, where samples would have the value itself.
_CENTRE = np.array([0.013, 0.021, -0.017])


def on_grid(field: Field, direction: Numbers, dimensions: tuple[int, int, int] = (22, 24, 20)) -> Volume:
    """A volume whose values are a function of the place in the world, from the middle of the box."""
    volume = Volume(np.zeros(dimensions[::-1]), (1, 0.8, 1.2), (50, -30, 7), direction)
    z, y, x = np.meshgrid(*(np.arange(count) for count in dimensions[::-1]), indexing="ij")
    positions = volume.origin + np.stack([x, y, z], axis=-1) @ volume.world_from_index.T
    return Volume(field(positions - volume.centre), volume.spacing, volume.origin, direction, name="v.nrrd")


def in_cube(field: Field, count: int) -> Volume:
    """A volume of count³ samples in the cube from -1 to 1, of a field around a place a little off its middle."""
    step = 2 / count
    axis = (np.arange(count) + 0.5) * step - 1
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return Volume(field(np.stack([x, y, z], axis=-1) - _CENTRE), (step,) * 3, (step / 2 - 1,) * 3)


def ball(radius: float) -> Field:
    """Distance to a sphere, positive inside."""
    return lambda p: radius - np.linalg.norm(p, axis=-1)


def torus(ring: float, tube: float, axis: int = 2) -> Field:
    """Distance to a torus around an axis, positive inside."""
    return lambda p: tube - np.hypot(np.linalg.norm(np.delete(p, axis, -1), axis=-1) - ring, p[..., axis])


def two_balls(radius: float) -> Field:
    """Distance to two spheres that touch in the middle, positive inside."""
    centre = np.array([0.6, 0.64, 0.48]) * radius  # a unit vector: not along the grid
    return lambda p: radius - np.minimum(*(np.linalg.norm(p + side * centre, axis=-1) for side in (-1, 1)))


def facets(mesh: Mesh) -> tuple[Numbers, Numbers]:
    """Corners, and cross products of the sides."""
    corners = mesh.vertices[mesh.triangles]
    return corners, np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def rms_distance(mesh: Mesh, field: Field) -> float:
    """Of the middles of triangles from the surface of a distance around `in_cube`'s place, weighted by area."""
    corners, normals = facets(mesh)
    weights = np.linalg.norm(normals, axis=1)
    distances = field(corners.mean(axis=1) - _CENTRE)
    return float(np.sqrt((distances**2 * weights).sum() / weights.sum()))
