"""Derivatives from a plane fitted to all samples around, weighted by a Gaussian: for volumes with noise.

Least squares with the weights w = exp(-(i² + j² + k²) / 2 scale²) over a box-shaped window. As weights and window are
products, the fit falls apart: along one axis the slope about the window's own mean, along the others a weighted mean,

    Σ w (i - ī) f / Σ w (i - ī)²        Σ w f / Σ w

and the border only cuts windows short. Where a sample is missing the weights are a product no longer, and the plane is
solved for. Noise of variance σ² leaves σ² / (16 π^1.5 scale⁵) in a component, where central differences leave σ² / 2:
a standard deviation 6.7 times smaller at scale 1, 38 times at scale 2.
"""

from __future__ import annotations

import math
from itertools import combinations_with_replacement, product

import numpy as np
from numpy.typing import NDArray

from texvol.scene.gradient.differences import central
from texvol.scene.gradient.neighbourhood import Neighbourhood, along, vector_along

_WIDTH = 3  # of the window, in scales to each side: what is left out weighs 0.3 % along an axis
# Below these a fit is no better than a guess: the variance of the samples' places along an axis, relative to that about
# the centre of the window, and the determinant of the correlations of the axes, 1 where they are independent.
_LEAST_SPREAD, _LEAST_DETERMINANT = 1e-6, 1e-3

_Orders = tuple[int, int, int]  # powers of the offsets along z, y, x
_AXES = range(3)


def reach_of(scale: float) -> int:
    """Number of samples to each side in the window of a scale."""
    return max(1, math.ceil(_WIDTH * scale))


def gaussian(block: Neighbourhood, scale: float) -> list[NDArray]:
    """Derivatives along z, y, x, per step of the index, at the samples of the box."""
    derivatives = _separable(block, scale)
    if block.there is None:
        return derivatives
    beside_gap = _spread_any(_missing(block), block.reach)
    if not beside_gap.any():
        return derivatives
    fitted = _fitted(block, scale)
    return [np.where(beside_gap, fit, plain) for fit, plain in zip(fitted, derivatives, strict=True)]


def _separable(block: Neighbourhood, scale: float) -> list[NDArray]:
    """The fit where nothing is missing. Along z first: chunks of a volume overlap least along y."""
    mean, slope = zip(*(_weights(block, axis, scale) for axis in _AXES), strict=True)
    mean_z = _mean(block.values, 0, mean[0])
    mean_zy = _mean(mean_z, 1, mean[1])
    return [
        _mean(_mean(_slope(block.values, 0, slope[0]), 1, mean[1]), 2, mean[2]),
        _mean(_slope(mean_z, 1, slope[1]), 2, mean[2]),
        _slope(mean_zy, 2, slope[2]),
    ]


def _weights(block: Neighbourhood, axis: int, scale: float) -> tuple[NDArray, NDArray]:
    """Weights of the window's samples in a mean and in a slope, shape (samples of the box, samples of the window)."""
    steps = np.arange(-block.reach, block.reach + 1)
    centres = block.positions(axis)[block.reach : -block.reach, np.newaxis]
    inside = (centres + steps >= 0) & (centres + steps < block.counts[axis])
    weight = inside * np.exp(-0.5 * (steps / scale) ** 2)
    mean = weight / weight.sum(axis=1, keepdims=True)
    from_middle = steps - (mean * steps).sum(axis=1, keepdims=True)
    spread = (weight * from_middle**2).sum(axis=1, keepdims=True)
    slope = weight * from_middle / np.where(spread > 0, spread, 1)  # one sample has none
    return mean.astype(block.values.dtype), slope.astype(block.values.dtype)


def _mean(values: NDArray, axis: int, weights: NDArray) -> NDArray:
    """Weighted mean along an axis, which gets shorter by the window."""
    reach = weights.shape[1] // 2
    return values[along(axis, reach, reach + len(weights))] + _slope(values, axis, weights)


def _slope(values: NDArray, axis: int, weights: NDArray) -> NDArray:
    """Weighted sum along an axis of what samples differ by from the one in the middle.

    Of differences, so that a constant has a slope of 0 and a mean of itself, and no rounded weight multiplies a large
    number that all of them share.
    """
    reach = weights.shape[1] // 2
    middle = values[along(axis, reach, reach + len(weights))]
    total = np.zeros_like(middle)
    for step in range(weights.shape[1]):
        if step != reach:
            difference = values[along(axis, step, step + len(weights))] - middle
            difference *= vector_along(axis, weights[:, step])
            total += difference
    return total


def _missing(block: Neighbourhood) -> NDArray[np.bool_]:
    """Samples of the volume that are not there."""
    assert block.there is not None
    missing = ~block.there
    for axis in _AXES:
        missing &= vector_along(axis, block.inside(axis))
    return missing


def _spread_any(mask: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """True where any sample in the window is set; each axis becomes shorter by the window."""
    for axis in _AXES:
        size = mask.shape[axis] - 2 * reach
        found = mask[along(axis, 0, size)].copy()
        for step in range(1, 2 * reach + 1):
            found |= mask[along(axis, step, step + size)]
        mask = found
    return mask


def _fitted(block: Neighbourhood, scale: float) -> list[NDArray]:
    """Slopes of the plane through the samples that are there; central differences where they determine none."""
    there = np.asarray(block.there, np.float64)
    values = block.values * there
    first = [_orders(a) for a in _AXES]
    second = {(a, b): _orders(a, b) for a, b in combinations_with_replacement(_AXES, 2)}
    weights = _moments(there, block.reach, scale, {(0, 0, 0), *first, *second.values()})
    products = _moments(values, block.reach, scale, {(0, 0, 0), *first})

    total = weights[0, 0, 0]
    some = np.where(total > 0, total, 1)
    covariance = {(a, b): weights[second[a, b]] - weights[first[a]] * weights[first[b]] / some for a, b in second}
    moment = [products[first[a]] - weights[first[a]] * products[0, 0, 0] / some for a in _AXES]
    determined = total > 0
    deviation = []
    for a in _AXES:
        variance = covariance[a, a]
        if block.counts[a] > 1:
            spread = variance > _LEAST_SPREAD * weights[second[a, a]]
            determined &= spread
            deviation.append(np.sqrt(np.where(spread, variance, 1)))
        else:
            deviation.append(np.ones_like(variance))
    correlation = [covariance[a, b] / (deviation[a] * deviation[b]) for a, b in ((0, 1), (0, 2), (1, 2))]
    slopes, determinant = _solved(correlation, [m / d for m, d in zip(moment, deviation, strict=True)])
    determined &= determinant > _LEAST_DETERMINANT
    dtype = block.values.dtype
    # A plane that few samples hold may be steep; a sum of three has to stay a number.
    steepest = np.finfo(dtype).max / 4
    return [
        np.where(determined, np.clip(slope / (d * block.reach), -steepest, steepest).astype(dtype), difference)
        for slope, d, difference in zip(slopes, deviation, central(block), strict=True)
    ]


def _orders(*axes: int) -> _Orders:
    return axes.count(0), axes.count(1), axes.count(2)


def _moments(numbers: NDArray, reach: int, scale: float, wanted: set[_Orders]) -> dict[_Orders, NDArray]:
    """Sums over the window of weight, offset to some powers, and number; offsets are counted in `reach`.

    The weights sum to 1 and the offsets are at most 1, so that no sum is larger than the largest number.
    """
    steps = np.arange(-reach, reach + 1)
    weights = np.exp(-0.5 * (steps / scale) ** 2)
    kernels = [weights / weights.sum() * (steps / reach) ** order for order in _AXES]
    found: dict[_Orders, NDArray] = {}
    for z, y in product(_AXES, repeat=2):
        orders = sorted(order for order in wanted if order[:2] == (z, y))
        if orders:
            plane = _correlated(_correlated(numbers, 0, kernels[z]), 1, kernels[y])
            found |= {order: _correlated(plane, 2, kernels[order[2]]) for order in orders}
    return found


def _correlated(numbers: NDArray, axis: int, kernel: NDArray) -> NDArray:
    size = numbers.shape[axis] - len(kernel) + 1
    total = np.zeros_like(numbers[along(axis, 0, size)])
    for step, weight in enumerate(kernel):
        if weight:
            total += numbers[along(axis, step, step + size)] * weight
    return total


def _solved(correlation: list[NDArray], right: list[NDArray]) -> tuple[list[NDArray], NDArray]:
    """Solution of three equations with a symmetric matrix of unit diagonal, by Cramer's rule, and its determinant."""
    a, b, c = correlation  # of z and y, z and x, y and x
    z, y, x = right
    determinant = 1 + 2 * a * b * c - a * a - b * b - c * c
    some = np.where(determinant > 0, determinant, 1)
    return [
        ((1 - c * c) * z + (b * c - a) * y + (a * c - b) * x) / some,
        ((b * c - a) * z + (1 - b * b) * y + (a * b - c) * x) / some,
        ((a * c - b) * z + (a * b - c) * y + (1 - a * a) * x) / some,
    ], determinant
