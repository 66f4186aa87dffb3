"""What the tests of annotation share: scenes on crooked grids, projections by matrices, and what a picture shows."""

from __future__ import annotations

import numpy as np

from support.scenes import clip_from_world
from texvol.annotation import Annotation, annotate
from texvol.annotation.lettering import Lettering
from texvol.annotation.sheet import Sheet
from texvol.annotation.view import View
from texvol.scene.camera import Camera, Projection
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

EVERYTHING = {"box": True, "axes": True, "legend": True, "scale_bar": True, "title": "All of it, µm² at 45°"}
DIRECTIONS = {
    "straight": np.eye(3),
    "mirrored": np.diag([-1.0, 1, 1]),
    "permuted": np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]]),
    "oblique": np.array([[0.9, -0.3, 0.1], [0.35, 0.9, -0.2], [-0.05, 0.25, 0.97]]),
    "sheared": np.array([[-1, 0.5, 0], [0.1, 1, 0.4], [0, -0.3, 1]]),
    "slanted": np.array([[1, -0.8, 0], [0, 0.6, 0.7], [0, 0, 0.7]]),  # edges far from the normals of their faces
}


def crooked(direction: str = "straight", space: str = "", unit: str = "mm") -> Volume:
    """A box of 40 x 36 x 28 mm or so, away from the origin."""
    values = np.random.default_rng(1).random((7, 9, 8)).astype(np.float32)
    return Volume(values, (5, 4, 4), (-30, 12, 100), DIRECTIONS[direction], unit=unit, space=space, name=direction)


def outside(volume: Volume, projection: Projection = "perspective", aspect: float = 1.0) -> Camera:
    """A camera that looks at three faces from outside, and rolled a little."""
    eye = volume.centre + 3.2 * volume.radius * np.array([0.55, -0.7, 0.45])
    return Camera.framing(volume, projection, eye=eye, up=(0.1, 0.05, 1), aspect=aspect)


def projected(points: np.ndarray, camera: Camera, size: tuple[int, int]) -> np.ndarray:
    """Pixels from the upper left corner to the right and down of world points, by the matrices of OpenGL; (n, 2)."""
    width, height = size
    matrix = clip_from_world(camera, width / height, 1e-3, 1e5)
    clip = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    x, y = (clip[:, :2] / clip[:, 3:]).T
    return np.column_stack([(x + 1) / 2 * width, (1 - y) / 2 * height])


def corners(volume: Volume) -> np.ndarray:
    """The corners of the box, from its origin, direction and spacing; corner c has bit a set on axis a's far side."""
    bits = np.array([[c & 1, c >> 1 & 1, c >> 2 & 1] for c in range(8)])
    index = bits * np.array(volume.dimensions) - 0.5
    return volume.origin + (index * volume.spacing) @ volume.direction.T


def coverage(scene: Scene, size: tuple[int, int], **parts: object) -> np.ndarray:
    """What annotation covers of each pixel of an opaque picture: by how much less of the picture is left."""
    annotation = Annotation(**parts)  # type: ignore[arg-type]
    dark, bright = (np.full((size[1], size[0], 4), light) for light in (0.0, 1.0))
    dark[..., 3] = 1
    left = annotate(bright, scene, size, annotation)[..., 0] - annotate(dark, scene, size, annotation)[..., 0]
    return 1 - left


def ink(scene: Scene, size: tuple[int, int], **parts: object) -> np.ndarray:
    """How much white there is in each pixel of an empty black picture with white annotation."""
    empty = np.zeros((size[1], size[0], 4))
    return annotate(empty, scene, size, Annotation(color=(1, 1, 1), **parts))[..., 0]  # type: ignore[arg-type]


def blank(scene: Scene, size: tuple[int, int]) -> tuple[Sheet, View]:
    """A sheet with nothing on it, and the scene's view."""
    return Sheet(size, Lettering(), scene.background), View(scene.completed(size).camera, scene.volume, size)
