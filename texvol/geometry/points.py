"""Points with normals, as dividing cubes make them: data, checked when they are made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.util.errors import InputError
from texvol.util.kept_arrays import KeepsArrays


@dataclass(frozen=True, eq=False)
class Points(KeepsArrays):
    """Points on a surface.

    Parameters
    ----------
    points : array of shape (n, 3)
        World units.
    normals : array of shape (n, 3)
        Unit vectors to the side of lower values; 0 where the gradient is.
    name : str
        What messages call them.

    Raises
    ------
    InputError
        If there are none, a number is not finite, or a shape is wrong.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    name: str = "points"

    def __post_init__(self) -> None:
        for what in ("points", "normals"):
            numbers = np.array(getattr(self, what), np.float64)
            if numbers.ndim != 2 or numbers.shape[1] != 3 or not len(numbers):
                raise InputError(f"{self.name}: {what} must have shape (n, 3), got {numbers.shape}")
            if not np.isfinite(numbers).all():
                raise InputError(f"{self.name}: {what} must be finite")
            numbers.setflags(write=False)
            object.__setattr__(self, what, numbers)
        if len(self.points) != len(self.normals):
            raise InputError(
                f"{self.name}: normals must be as many as points, {len(self.points)}, got {len(self.normals)}"
            )

    def __repr__(self) -> str:
        return f"Points({self.name!r}, {len(self.points)} points)"
