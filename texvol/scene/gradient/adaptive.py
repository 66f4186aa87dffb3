"""Choice between 6 and 26 neighbours by the local variance, sample by sample (after Pommert et al. 1990).

A mean over 26 neighbours has less noise than a central difference, and rounds off what is as thin as its three samples.
Among the 27 samples around a place the variance that a plane through them leaves is that of the noise where the field
is smooth, and more where it bends within a sample. So a sample whose remaining variance is that of the volume's noise,
or not much more, takes the mean over 26, and one that has more to it the central difference.

The noise of a volume is told from places that are spread evenly: of the variances that are not 0 a quarter is below
that of most of the noise, whatever bends elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.scene.gradient.differences import central, zucker_hummel
from texvol.scene.gradient.neighbourhood import Neighbourhood, along

_PLACES = 4096  # at which the noise is measured
_QUANTILE = 0.25
_MOST = 2.0  # times the quantile of the noise; a thousandth of a chi-square of 23 degrees of freedom is beyond it
_FREEDOM = 23  # numbers that four of a plane leave of 27
_OFFSETS = np.indices((3, 3, 3)).reshape(3, -1).T - 1  # along z, y, x
_ROUNDING = 1e-12  # of the largest value, in double precision: a smaller deviation is none


@dataclass(frozen=True)
class Noise:
    """Noise of a volume's values, in the units of a neighbourhood's."""

    unit: float  # power of two that values lie within: so their squares are numbers
    middle: float  # about which they lie, in that unit
    most_variance: float  # that is taken for noise, in that unit

    @classmethod
    def of(cls, values: NDArray, scale: float) -> Noise:
        """Measure the noise of all values, shape (nz, ny, nx), times `scale`."""
        counts = np.array(values.shape)
        # Multiples of 1/g, 1/g², 1/g³ with g⁴ = g + 1 fill the cube evenly (Roberts 2018, R3).
        numbers = np.arange(1, _PLACES + 1)[:, np.newaxis] * 1.2207440846057596 ** -np.arange(1.0, 4.0) % 1
        places = (numbers * counts).astype(np.intp)[:, np.newaxis] + _OFFSETS
        z, y, x = np.moveaxis(np.clip(places, 0, counts - 1), -1, 0)
        around = values[z, y, x].astype(np.float64) * scale
        around = around[np.isfinite(around).all(axis=1)]
        if not around.size:
            return NO_NOISE
        unit = 2.0 ** np.ceil(np.log2(max(np.abs(around).max(), 1e-300)))
        around /= unit
        middle = float(around.mean())
        around -= around.mean(axis=1, keepdims=True)
        plane = around @ _OFFSETS / np.sqrt(18.0)  # components along three axes of length 1
        variances = ((around**2).sum(axis=1) - (plane**2).sum(axis=1)) / _FREEDOM
        noisy = variances[variances > _ROUNDING**2]
        return cls(unit, middle, _MOST * float(np.quantile(noisy, _QUANTILE)) if noisy.size else 0.0)


NO_NOISE = Noise(1.0, 0.0, 0.0)


def adaptive(block: Neighbourhood, noise: Noise) -> list[NDArray]:
    """Derivatives along z, y, x, per step of the index, at the samples of the box."""
    is_smooth = _variance_in(block, noise) <= noise.most_variance
    pairs = zip(zucker_hummel(block), central(block), strict=True)
    return [np.where(is_smooth, of_26, of_6) for of_26, of_6 in pairs]


def _variance_in(block: Neighbourhood, noise: Noise) -> NDArray[np.float64]:
    """Variance that a plane leaves of the 27 samples around each sample of the box."""
    values = block.crop(block.values, 1).astype(np.float64)
    values /= noise.unit
    values -= noise.middle
    total, squares = _sum_along(values, (0, 1, 2)), _sum_along(values**2, (0, 1, 2))
    left = squares - total**2 / 27
    for axis in range(3):
        size = values.shape[axis]
        difference = values[along(axis, 2, size)] - values[along(axis, 0, size - 2)]
        left -= _sum_along(difference, [other for other in range(3) if other != axis]) ** 2 / 18
    return left / _FREEDOM


def _sum_along(numbers: NDArray[np.float64], axes: tuple[int, ...] | list[int]) -> NDArray[np.float64]:
    """Sums of three neighbours along some axes, which get two shorter."""
    for axis in axes:
        size = numbers.shape[axis]
        outer = numbers[along(axis, 0, size - 2)] + numbers[along(axis, 2, size)]
        numbers = outer + numbers[along(axis, 1, size - 1)]
    return numbers
