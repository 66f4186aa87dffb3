"""Unit quaternions (w, x, y, z) as rotations, in float64.

exp takes a rotation vector, whose length is the angle in radians, to a quaternion; log is its inverse, of the shorter
of the two turns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Quaternion = NDArray[np.float64]
Vector = NDArray[np.float64]


def from_axes(axes: NDArray[np.float64]) -> Quaternion:
    """Return the rotation of a right-handed orthonormal frame whose axes are the columns, shape (3, 3) (Shepperd)."""
    # Of the four squares of components, times 4, the largest is at least 1: its root loses no digits.
    diagonal = np.diag(axes)
    squares = np.array([1 + diagonal.sum(), *(1 + 2 * diagonal - diagonal.sum())])
    largest = int(squares.argmax())
    (_, xy, xz), (yx, _, yz), (zx, zy, _) = axes
    products = np.array(
        [
            [squares[0], zy - yz, xz - zx, yx - xy],
            [zy - yz, squares[1], yx + xy, xz + zx],
            [xz - zx, yx + xy, squares[2], zy + yz],
            [yx - xy, xz + zx, zy + yz, squares[3]],
        ]
    )
    return unit(products[largest])


def to_axes(rotation: Quaternion) -> NDArray[np.float64]:
    """Return the axes of the rotated frame as columns, shape (3, 3)."""
    w, x, y, z = rotation
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def product(first: Quaternion, second: Quaternion) -> Quaternion:
    """Return the rotation by `second` and then by `first`, both about axes of the world."""
    a, u, b, v = first[0], first[1:], second[0], second[1:]
    return np.concatenate([[a * b - u @ v], a * v + b * u + np.cross(u, v)])


def inverse(rotation: Quaternion) -> Quaternion:
    """Return the opposite rotation."""
    return rotation * np.array([1.0, -1.0, -1.0, -1.0])


def exp(vector: ArrayLike) -> Quaternion:
    """Return the rotation about a vector by its length in radians."""
    vector = np.asarray(vector, np.float64)
    half = float(np.linalg.norm(vector)) / 2
    return np.concatenate([[np.cos(half)], np.sinc(half / np.pi) / 2 * vector])


def log(rotation: Quaternion) -> Vector:
    """Return the rotation vector of a rotation by at most π."""
    near = rotation if rotation[0] >= 0 else -rotation
    sine = float(np.linalg.norm(near[1:]))
    if sine == 0:
        return np.zeros(3)
    return np.asarray(near[1:] * (2 * np.arctan2(sine, near[0]) / sine))


def unit(rotation: Quaternion) -> Quaternion:
    """Return the quaternion at length 1."""
    return np.asarray(rotation / np.linalg.norm(rotation))
