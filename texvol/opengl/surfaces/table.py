"""Shapes and primitives as the texels and vertices of surface.frag."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.surfaces.on_screen import Primitives
from texvol.scene.shapes import Lines, Mesh, Shape
from texvol.util.errors import InputError

TABLE_WIDTH = 4096
# Translucent lines are seen once on a ray; which it has passed are bits of a float32's whole numbers.
MOST_TRANSLUCENT_LINES = 24


def shapes_of(shapes: Sequence[Shape]) -> NDArray[np.float32]:
    """Two texels for each: colour and opacity; whether it is lit, is cut, is lines, and which bit it has.

    Raises
    ------
    InputError
        If there are more than 24 translucent Lines.
    """
    texels = np.zeros((len(shapes), 2, 4), np.float32)
    once = [number for number, shape in enumerate(shapes) if isinstance(shape, Lines) and shape.opacity < 1]
    if len(once) > MOST_TRANSLUCENT_LINES:
        raise InputError(f"scene: at most {MOST_TRANSLUCENT_LINES} Lines can be translucent, got {len(once)}")
    for number, shape in enumerate(shapes):
        texels[number, 0] = *shape.color, shape.opacity
        bit = float(1 << once.index(number)) if number in once else 0.0
        texels[number, 1] = isinstance(shape, Mesh) and shape.lit, shape.cut, isinstance(shape, Lines), bit
    return texels.reshape(-1, 4)


def rows_of(primitives: Primitives, lit: bool) -> NDArray[np.float32]:
    """Six texels for each primitive, its numbers in float32 and what that leaves; three more for normals."""
    high = primitives.numbers.astype(np.float32)
    low = (primitives.numbers - high).astype(np.float32)
    parts = [high, low]
    if lit:
        parts.append(np.pad(primitives.normals.astype(np.float32), [(0, 0), (0, 0), (0, 1)]))
    return np.concatenate(parts, axis=1).reshape(-1, 4)


def vertices_of(primitives: Primitives, which: NDArray[np.bool_], size: tuple[int, int]) -> NDArray[np.float32]:
    """The corners of the covers of those that are chosen: (x, y, number of the primitive, of its shape) for each."""
    vertices = np.empty((int(which.sum()), 6, 4), np.float32)
    vertices[..., :2] = primitives.covers[which] / (np.array(size) / 2)
    vertices[..., 2] = np.flatnonzero(which)[:, np.newaxis]
    vertices[..., 3] = primitives.shape[which, np.newaxis]
    return vertices
