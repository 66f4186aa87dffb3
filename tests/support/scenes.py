"""Volumes, transfer functions and cameras that several tests draw."""

from __future__ import annotations

import numpy as np
from pyrr import matrix44

from texvol.scene import orbit
from texvol.scene.camera import Camera, Projection
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

FOG = TransferFunction(
    np.array([0, 0.3, 0.6, 1]),
    np.array([(0.2, 0.3, 0.9), (0.4, 0.8, 0.5), (0.9, 0.6, 0.2), (1, 1, 0.9)]),
    np.array([0, 0.004, 0.012, 0.03]),
)
BONE = TransferFunction(
    np.array([0, 0.45, 0.55, 0.8, 1]),
    np.array([(0.5, 0.1, 0.05), (0.6, 0.3, 0.1), (0.9, 0.8, 0.6), (1, 1, 0.9), (1, 1, 1)]),
    np.array([0, 0, 0.15, 0.5, 0.8]),
)


def constant(extinction: float, color: tuple[float, float, float] = (0.9, 0.6, 0.3)) -> TransferFunction:
    """The same matter whatever the value."""
    return TransferFunction(np.zeros(1), np.array([color]), np.array([extinction]))


def smooth_volume(samples: int = 48) -> Volume:
    """A few waves between 0 and 1, none shorter than a quarter of the box."""
    z, y, x = np.meshgrid(*[(np.arange(samples) + 0.5) / samples * 2 - 1] * 3, indexing="ij")
    values = 0.5 + 0.5 * np.sin(3 * x + y) * np.cos(4 * y - z) * np.sin(3 * z + 1)
    return Volume(values.astype(np.float32), name="smooth")


def random_volume(seed: int, dimensions: tuple[int, int, int] = (9, 8, 7)) -> Volume:
    """White noise between 0 and 1 on an anisotropic grid."""
    random = np.random.default_rng(seed)
    return Volume(random.random(dimensions[::-1]).astype(np.float32), (1.0, 1.3, 0.7), name=f"noise {seed}")


def inside(volume: Volume, projection: Projection) -> Camera:
    """A camera with its eye inside the box, off every symmetry."""
    eye = volume.centre + 0.2 * volume.radius * np.array([0.3, -0.5, 0.4])
    target = eye + np.array([-0.5, 1.0, -0.35])
    if projection == "perspective":
        return Camera.perspective(eye, target, (0, 0, 1), fov=70)
    return Camera.orthographic(eye, target, (0, 0, 1), height=2 * volume.radius)


def path_lengths(volume: Volume, camera: Camera, size: tuple[int, int]) -> np.ndarray:
    """World length of each pixel's ray inside the box and in front of the eye, shape (height, width)."""
    origins, directions = camera.rays(size)
    unit_from_world = volume.index_from_world / np.array(volume.dimensions)[:, np.newaxis]
    position = (origins - volume.box_corner) @ unit_from_world.T
    line_of_sight = directions @ unit_from_world.T
    with np.errstate(divide="ignore"):
        a, b = -position / line_of_sight, (1 - position) / line_of_sight
    enters = np.maximum(np.minimum(a, b).max(axis=2), 0)
    return np.maximum(np.maximum(a, b).min(axis=2) - enters, 0)


def sparse_volume(seed: int) -> Volume:
    """A few clumps of noise between 0.3 and 1 in an empty box, on a sheared, left-handed, anisotropic grid."""
    random = np.random.default_rng(seed)
    values = np.zeros((41, 50, 37), np.float32)
    for _ in range(4):
        z, y, x = (random.integers(0, count - 6) for count in values.shape)
        values[z : z + 6, y : y + 5, x : x + 4] = random.uniform(0.3, 1, (6, 5, 4))
    direction = np.array([[-1, 0.2, 0], [0.1, 1, 0.3], [0, -0.2, 1]])
    return Volume(values, (1.0, 0.8, 1.2), (-3, 5, 7), direction, name=f"clumps {seed}")


def clip_from_world(camera: Camera, aspect: float, near: float, far: float) -> np.ndarray:
    """The matrix of OpenGL, shape (4, 4), that shows what lies at depths `near` to `far`, in world units."""
    if camera.projection == "perspective":
        projection = matrix44.create_perspective_projection(camera.fov, aspect, near, far, dtype=np.float64)
    else:
        y = camera.half_height
        projection = matrix44.create_orthogonal_projection(-y * aspect, y * aspect, -y, y, near, far, dtype=np.float64)
    return projection.T @ camera.eye_from_world


def orbiting(camera: Camera, views: int) -> list[Camera]:
    """The cameras of one turn in equal steps, the first is the camera itself."""
    return [orbit.turned(camera, 360 * i / views) for i in range(views)]
