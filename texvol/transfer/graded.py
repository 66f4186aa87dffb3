"""Matter that depends on the gradient: its emission and extinction, by value and gradient magnitude |∇f|.

    Graded    points by value, times clamp((|∇f| - start) / (full - start), 0, 1)
    Contour   Levoy's isovalue contour (1988): matter times max(0, 1 - |f - value| / (thickness |∇f|))

Both are premultiplied: what they add to the emission q and the extinction τ of a place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Graded:
    """Points by value, piecewise linear, nothing before the first and after the last, times a ramp in |∇f|.

    Attributes
    ----------
    values : array of shape (n,)
        Data units, never descending; equal neighbours make a step.
    emissions : array of shape (n, 3)
        q per world unit.
    extinctions : array of shape (n,)
        τ per world unit, finite.
    start, full : float
        Gradient magnitudes, data units per world unit, at which the weight begins to rise from 0 and reaches 1; where
        they are equal it is a step, 1 from there on.
    """

    values: NDArray[np.float64]
    emissions: NDArray[np.float64]
    extinctions: NDArray[np.float64]
    start: float
    full: float


@dataclass(frozen=True)
class Contour:
    """Matter of a surface of one value; `thickness` in world units; where |∇f| is 0, only the value itself counts."""

    value: float
    thickness: float
    emission: tuple[float, float, float]  # q per world unit
    extinction: float  # τ per world unit, finite
