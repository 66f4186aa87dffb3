"""Optics of emission and absorption: the slab integral and *over*.

Along a ray with emission q and extinction τ per world unit (Wilson, Van Gelder, Wilhelms 1994; Max 1995),

    I = ∫ q(s) T(s) ds,   T(s) = exp(-∫ τ),   opacity = 1 - T at the end.

Where q and τ are constant over a length L, with x = τ L the optical depth and φ(x) = (1 - e^-x) / x,

    opacity A = 1 - e^-x,   colour C = q L φ(x),   premultiplied.

`shaders/optics.glsl` is the twin of this module; a test compares the two.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def opacity_from_depth(optical_depth: ArrayLike) -> NDArray[np.float64]:
    """1 - e^-x for optical depths x in [0, ∞]; expm1 keeps the digits of a thin slab (x = 1e-30 stays 1e-30)."""
    return -np.expm1(-np.asarray(optical_depth, dtype=np.float64))


def depth_from_opacity(opacity: ArrayLike) -> NDArray[np.float64]:
    """-log(1 - A) for opacities A in [0, 1]; 1 is infinitely deep."""
    with np.errstate(divide="ignore"):
        return -np.log1p(-np.asarray(opacity, dtype=np.float64))


def mean_transmittance(optical_depth: ArrayLike) -> NDArray[np.float64]:
    """φ(x) = (1 - e^-x) / x, the transmittance averaged over a slab of optical depth x; φ(0) = 1, φ(∞) = 0."""
    x = np.asarray(optical_depth, dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(x > 0, opacity_from_depth(x) / x, 1.0)


def is_shallow(deepest: float) -> bool:
    """True if the shader needs no exponential for optical depths up to `deepest`."""
    return deepest <= 2


def slab_integral(
    emission: ArrayLike, extinction: ArrayLike, path_length: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Premultiplied colour and opacity of a slab in which emission and extinction are constant.

    Parameters
    ----------
    emission : array of shape (…, 3)
        q, per world unit; where the extinction is infinite, the colour that shows.
    extinction : array of shape (…)
        τ, per world unit, in [0, ∞].
    path_length : array of shape (…)
        L, world units.
    """
    length = np.asarray(path_length, dtype=np.float64)
    depth = np.asarray(extinction, dtype=np.float64) * length
    thickness_seen = np.where(np.isinf(extinction), 1.0, length * mean_transmittance(depth))
    return np.multiply(emission, thickness_seen[..., np.newaxis]), opacity_from_depth(depth)


def over(front: NDArray, back: NDArray) -> NDArray:
    """`front` over `back`, premultiplied, shape (…, 4): C_f + (1 - A_f) C_b (Porter, Duff 1984)."""
    return front + (1 - front[..., 3:]) * back
