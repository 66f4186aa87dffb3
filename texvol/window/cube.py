"""Orientation cube: its corners in the picture, and what of it lies under a point.

The cube has the edges of the world's axes, and is turned as the camera sees them. Its corners are at ±1; a point p, in
the camera's axes to the right, upwards and to the eye, is seen from an eye at distance F = 6:

    position = F / (F - p_z) (p_x, p_y)

A pick is the sum of the normals of one face, of two faces at an edge, or of three at a corner.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera

_AWAY = 6.0
_RIM = 0.62  # from here to the border of a face is the part of its edges and corners
Vector = NDArray[np.float64]
Pick = tuple[int, int, int]


def _frame(camera: Camera) -> NDArray[np.float64]:
    """Return the unit vectors to the right, upwards and to the eye as rows."""
    return np.stack([camera.right, camera.upward, -camera.forward])


def positions(camera: Camera, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the positions of points of the cube, shape (n, 3), about the cube's middle, y upwards, shape (n, 2)."""
    seen = points @ _frame(camera).T
    return seen[:, :2] * (_AWAY / (_AWAY - seen[:, 2:]))


def visible_faces(camera: Camera) -> list[tuple[int, int]]:
    """Return the faces that are seen, as axis and sign, the one that faces the eye most last."""
    towards = _frame(camera)[2]
    faces = [(axis, sign) for axis, sign in product(range(3), (1, -1)) if _AWAY * sign * towards[axis] > 1]
    return sorted(faces, key=lambda face: float(face[1] * towards[face[0]]))


def patch(face: tuple[int, int], pick: Pick = (0, 0, 0), rim: float = 1.0) -> NDArray[np.float64]:
    """Return the corners of a face, shape (4, 3), or of the part of it that belongs to a pick."""
    axis, sign = face
    ends: list[tuple[float, float]] = []
    for other in range(3):
        side = pick[other]
        if other == axis:
            ends.append((sign, sign))
        elif any(pick):
            ends.append((-_RIM, _RIM) if side == 0 else (side * _RIM, side * rim))
        else:
            ends.append((-rim, rim))
    first, second = ((axis + 1) % 3, (axis + 2) % 3)
    corners = np.zeros((4, 3))
    corners[:, axis] = sign
    corners[:, first] = np.array(ends[first])[[0, 1, 1, 0]]
    corners[:, second] = np.array(ends[second])[[0, 0, 1, 1]]
    return corners


def pick(camera: Camera, position: tuple[float, float]) -> Pick | None:
    """Return what lies at a position about the cube's middle, y upwards; None beside the cube."""
    frame = _frame(camera)
    eye = _AWAY * frame[2]
    ray = position[0] * frame[0] + position[1] * frame[1] - eye
    with np.errstate(divide="ignore", invalid="ignore"):
        enters = np.where(ray != 0, (-np.sign(ray) - eye) / ray, -np.inf)
        leaves = np.where(ray != 0, (np.sign(ray) - eye) / ray, np.inf)
    outside = (ray == 0) & (np.abs(eye) > 1)
    if outside.any() or enters.max() > leaves.min():
        return None
    axis = int(enters.argmax())
    point = eye + enters[axis] * ray
    found = [int(np.sign(each)) if abs(each) > _RIM else 0 for each in point]
    found[axis] = int(-np.sign(ray[axis]))
    return found[0], found[1], found[2]


def direction(picked: Pick) -> Vector:
    """Return the unit vector of a pick."""
    vector = np.array(picked, np.float64)
    return np.asarray(vector / np.linalg.norm(vector))


# Strokes of the letters on the faces, from (-1, -1) to (1, 1), y upwards.
_CURVE = [(-1, 1), (0.35, 1), (0.85, 0.8), (1, 0.5), (0.85, 0.2), (0.35, 0), (-1, 0)]
STROKES: dict[str, list[list[tuple[float, float]]]] = {
    "R": [[(-1, -1), *_CURVE], [(0.1, 0), (1, -1)]],
    "L": [[(-1, 1), (-1, -1), (0.9, -1)]],
    "A": [[(-1, -1), (0, 1), (1, -1)], [(-0.62, -0.25), (0.62, -0.25)]],
    "P": [[(-1, -1), *_CURVE]],
    "S": [
        [(0.9, 0.7), (0.5, 0.95), (0, 1), (-0.6, 0.92), (-0.9, 0.6), (-0.75, 0.25), (0, 0)],
        [(0, 0), (0.75, -0.25), (0.95, -0.6), (0.6, -0.92), (0, -1), (-0.55, -0.95), (-0.95, -0.7)],
    ],
    "I": [[(0, 1), (0, -1)], [(-0.5, 1), (0.5, 1)], [(-0.5, -1), (0.5, -1)]],
    "X": [[(-0.9, -1), (0.9, 1)], [(-0.9, 1), (0.9, -1)]],
    "Y": [[(-0.9, 1), (0, 0), (0.9, 1)], [(0, 0), (0, -1)]],
    "Z": [[(-0.85, 1), (0.85, 1), (-0.85, -1), (0.85, -1)]],
    "+": [[(-0.8, 0), (0.8, 0)], [(0, -0.8), (0, 0.8)]],
    "−": [[(-0.8, 0), (0.8, 0)]],
}


def letter_strokes(text: str, face: tuple[int, int], up: Vector) -> list[NDArray[np.float64]]:
    """Return the strokes of one or two letters on a face as lines of points of the cube, each of shape (n, 3)."""
    axis, sign = face
    normal = np.eye(3)[axis] * sign
    right = np.cross(up, normal)
    width, height, apart = (0.36, 0.5, 0.0) if len(text) == 1 else (0.26, 0.38, 0.36)
    found = []
    for number, letter in enumerate(text):
        middle = (2 * number - (len(text) - 1)) * apart
        for stroke in STROKES[letter]:
            places = np.array(stroke, np.float64)
            x, y = middle + width * places[:, :1], height * places[:, 1:]
            found.append(normal + x * right + y * up)
    return found
