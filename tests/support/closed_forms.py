"""Pictures of single rays that are known in closed form; what the oracle and the renderer are held against.

Throughout: τ extinction and q emission per world unit, c straight colour, D path length, x = τ D optical depth,
T transmittance, I the light that arrives. Every function takes and returns floats or arrays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import dawsn, erf, erfcx

Numbers = NDArray[np.float64]


def mean_transmittance(x: ArrayLike) -> Numbers:
    """φ(x) = ∫0..1 e^(-x u) du = (1 - e^-x) / x; φ(0) = 1."""
    x = np.asarray(x, dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(x > 0, -np.expm1(-x) / x, 1.0)


def opacity(optical_depth: ArrayLike) -> Numbers:
    """1 - e^-x."""
    return -np.expm1(-np.asarray(optical_depth, dtype=np.float64))


def constant_medium(emission: ArrayLike, extinction: float, length: float) -> Numbers:
    """I = ∫0..D q e^(-τ s) ds = q D φ(τ D)."""
    return np.asarray(emission) * length * mean_transmittance(extinction * length)


def over(front: ArrayLike, back: ArrayLike) -> Numbers:
    """Premultiplied (…, 4) composited: what the front emits, and what it lets through of the back."""
    front, back = np.asarray(front), np.asarray(back)
    return front + (1 - front[..., 3:]) * back


def layer(color: ArrayLike, extinction: float, length: float) -> Numbers:
    """Premultiplied rgba of constant matter that shows its own colour: (c α, α)."""
    alpha = opacity(extinction * length)
    return np.append(np.asarray(color) * alpha, alpha)


def mean_transmittance_of_ramp(a: float, b: float, length: float) -> float:
    """Ψ = 1/D ∫0..D exp(-(a s + (b - a) s² / 2D)) ds, τ rising or falling linearly from a to b.

    Completing the square with k = √(2 |b - a| / D) leaves a Gauss integral of real argument where τ rises, of
    imaginary argument where it falls; erfcx and Dawson's function are these with the exponential divided out.
    """
    if a == b:
        return float(mean_transmittance(a * length))
    k = np.sqrt(2 * abs(b - a) / length)
    x0, x1 = a / k, b / k
    if b > a:
        return float(np.sqrt(np.pi) / (k * length) * (erfcx(x0) - np.exp(x0**2 - x1**2) * erfcx(x1)))
    return float(2 / (k * length) * (dawsn(x0) - np.exp(x1**2 - x0**2) * dawsn(x1)))


def ramp(front_color: ArrayLike, back_color: ArrayLike, a: float, b: float, length: float) -> Numbers:
    """Premultiplied rgba of matter whose τ (a to b) and colour are both linear along the ray.

    By parts, I = -∫ c dT = c_f - c_b ζ + (c_b - c_f) Ψ with ζ = T(D), that is c_f (1 - Ψ) + c_b (Ψ - ζ).
    """
    psi, depth = mean_transmittance_of_ramp(a, b, length), (a + b) * length / 2
    light = np.asarray(front_color) * (1 - psi) + np.asarray(back_color) * (psi - np.exp(-depth))
    return np.append(light, opacity(depth))


def exponential_depth(tau: float, k: float, length: float) -> float:
    """∫0..D τ e^(-k z) dz."""
    return -tau * float(np.expm1(-k * length)) / k


def emission_ramp(front: float, back: float, extinction: float, length: float) -> float:
    """∫0..D q T ds, q linear and τ constant: by parts, with x = τ D, (q_f - q_b e^-x + (q_b - q_f) φ(x)) / τ."""
    x = extinction * length
    return float((front - back * np.exp(-x) + (back - front) * mean_transmittance(x)) / extinction)


def fading_emission(q: float, k: float, extinction: float, length: float) -> float:
    """∫0..D q e^(-k t) e^(-τ t) dt = q (1 - e^(-(τ + k) D)) / (τ + k)."""
    return -q * float(np.expm1(-(extinction + k) * length)) / (extinction + k)


def ball_chord(radius: float, offset: ArrayLike) -> Numbers:
    """Length of a line at distance `offset` from the centre, inside a ball; 0 beside it."""
    return 2 * np.sqrt(np.maximum(radius**2 - np.asarray(offset) ** 2, 0))


def ball_mean_opacity(x: float) -> float:
    """Mean opacity over the disc of a ball of x = τ R: 2/R² ∫0..R (1 - e^(-2τ√(R²-b²))) b db."""
    if x < 1e-2:  # the next term of the series is 8 x³ / 15: the closed form cancels to worse than this
        return 4 * x / 3 - x**2 + 8 * x**3 / 15
    return float(1 - (1 - (1 + 2 * x) * np.exp(-2 * x)) / (2 * x**2))


def gaussian_depth(tau: float, sigma: float, offset: ArrayLike, start: float, end: float) -> Numbers:
    """∫ τ e^(-(b² + t²)/2σ²) dt from `start` to `end` along a line at distance b."""
    scale = np.sqrt(2) * sigma
    along = tau * sigma * np.sqrt(np.pi / 2) * (erf(end / scale) - erf(start / scale))
    return along * np.exp(-((np.asarray(offset) / scale) ** 2))


def shell_chord(inner: float, outer: float, offset: ArrayLike) -> Numbers:
    """Length of a line inside a hollow ball."""
    return ball_chord(outer, offset) - ball_chord(inner, offset)


def sinusoid_depth(tau: float, epsilon: float, k: float, start: float, end: float) -> float:
    """∫ τ (1 + ε sin kz) dz from `start` to `end`."""
    return tau * (end - start + epsilon * (np.cos(k * start) - np.cos(k * end)) / k)
