"""A small volume without symmetry, one voxel of it marked: whether a reader turned it shows in where the mark lies."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol import Volume

DIMENSIONS = (5, 4, 3)
MARK = (3, 1, 2)  # index x, y, z of the voxel that is larger than all others
MARK_VALUE = 100

# Spacing 2, 3, 4; the last axis runs backwards and a rotation by 30° about z follows: left-handed and oblique, and not
# symmetric, so that a transposed matrix shows.
SPACING = (2.0, 3.0, 4.0)
ORIGIN = (10.0, -20.0, 30.5)
_COSINE, _SINE = np.cos(np.pi / 6), np.sin(np.pi / 6)
DIRECTION = np.array([[_COSINE, -_SINE, 0], [_SINE, _COSINE, 0], [0, 0, 1]]) @ np.diag([1.0, 1.0, -1.0])


def marked(dtype: str | np.dtype = "int16") -> NDArray:
    """Values of shape (3, 4, 5), different everywhere, from 0 to 59 but for the mark of 100."""
    values = np.arange(60).reshape(DIMENSIONS[::-1]).astype(dtype)
    values[MARK[::-1]] = MARK_VALUE
    return values


def position_of_mark(
    spacing: ArrayLike = SPACING, origin: ArrayLike = ORIGIN, direction: ArrayLike = DIRECTION
) -> NDArray[np.float64]:
    """World position of the mark, by the definition of the grid."""
    return np.array(origin) + np.array(direction) @ (np.array(spacing) * MARK)


def found_mark(volume: Volume) -> NDArray[np.float64]:
    """World position of a volume's largest value."""
    z, y, x = np.unravel_index(np.argmax(volume.values), volume.values.shape)
    return volume.origin + volume.world_from_index @ np.array([x, y, z])


def check(volume: Volume, dtype: str = "int16", *, position: ArrayLike | None = None, atol: float = 1e-9) -> None:
    """Fail unless the volume holds the marked values, with that type, in the marked place."""
    assert volume.values.dtype == np.dtype(dtype).newbyteorder("=")
    np.testing.assert_array_equal(volume.values, marked(dtype))
    wanted = position_of_mark() if position is None else position
    np.testing.assert_allclose(found_mark(volume), np.asarray(wanted), rtol=0, atol=atol)
