"""Small fields of any type."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def wave(samples: int, dtype: str) -> NDArray:
    """A smooth field of so many samples along each axis: 0 to 1 in floats, 0 to 200 in integers, 0 to 20 in i1."""
    z, y, x = np.mgrid[:samples, :samples, :samples] / samples * 2 * np.pi
    field = (np.sin(x) * np.cos(y) * np.sin(2 * z) + 1) / 2
    most = {"f": 1, "u": 200, "i": 20 if np.dtype(dtype).itemsize == 1 else 200}[np.dtype(dtype).kind]
    return (field * most).astype(dtype)
