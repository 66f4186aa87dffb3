"""Noise of a volume's values, told from structure by the variogram.

Half the mean squared difference of values h samples apart is γ(h) = noise + structure(h), in fractions of the variance
of the values. Noise differs from sample to sample, so that its part is the same for each h; structure grows with h, at
first at least in proportion. Hence the noise is 2 γ(1) - γ(2) or more (the nugget of geostatistics, Matheron 1963).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume

_LOOKED_AT = 1 << 21  # samples in the middle of the volume
_FEWEST = 1 << 12  # samples that tell noise from structure
LEAST_NOISE = 0.15  # of the variance, along every axis: surfaces are rough to the size of what they are of
MOST_NOISE = 0.5  # where it is more than the structure, the haze of the sum hides that, too


def noise_of(volume: Volume) -> float:
    """Return the part of the variance of a volume's values that is noise, at least; 0 where too few samples tell."""
    values = _middle(volume)
    if values.size < _FEWEST or min(values.shape) < 3:
        return 0.0
    largest = max(float(values.max()), -float(values.min()), 1e-300)
    scaled = np.divide(values, largest, out=np.empty(values.shape, np.float32), casting="same_kind")
    variance = float(scaled.var(dtype=np.float64))
    if not variance > 0:
        return 0.0
    noise = min(2 * _semivariance(scaled, axis, 1) - _semivariance(scaled, axis, 2) for axis in range(3)) / variance
    return max(noise, 0.0)


def clearest_axis(volume: Volume) -> int:
    """Return the number of the axis, x, y or z, along which a sum shows most: its means vary most from line to line."""
    values = _middle(volume)
    return int(np.argmax([values.mean(axis=axis).var() for axis in (2, 1, 0)]))


def _middle(volume: Volume) -> NDArray[np.float64]:
    """Return the samples in the middle of a volume, at most `_LOOKED_AT`; what is missing has their mean."""
    values = volume.overview.values
    part = min((_LOOKED_AT / values.size) ** (1 / 3), 1.0)
    kept = [max(round(part * count), min(count, 3)) for count in values.shape]
    cut = tuple(slice((count - keep) // 2, (count + keep) // 2) for count, keep in zip(values.shape, kept, strict=True))
    numbers = values[cut].astype(np.float64)
    finite = np.isfinite(numbers)
    if finite.all():
        return numbers
    return np.where(finite, numbers, numbers[finite].mean() if finite.any() else 0.0)


def _semivariance(values: NDArray[np.float32], axis: int, apart: int) -> float:
    """Return half the mean squared difference of values so many samples apart."""
    along = np.moveaxis(values, axis, 0)
    difference = np.moveaxis(along[apart:] - along[:-apart], 0, axis)
    return float(np.square(difference, out=difference).mean(dtype=np.float64)) / 2
