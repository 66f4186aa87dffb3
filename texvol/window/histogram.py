"""Histogram of a volume's values, for the transfer function editor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume

_BINS = 256
_MOST_SAMPLES = 1 << 22  # larger volumes are thinned: 256 columns do not show the difference
_LARGEST = 0.4 * float(np.finfo(np.float64).max)  # so that the difference of two edges does not overflow


@dataclass(frozen=True, eq=False)
class Histogram:
    """Counts of values between edges.

    Attributes
    ----------
    edges : array of shape (bins + 1)
        Values, ascending.
    counts : array of shape (bins)
        Number of samples between two edges.
    """

    edges: NDArray[np.float64]
    counts: NDArray[np.float64]

    def heights(self, logarithmic: bool) -> NDArray[np.float64]:
        """Return the columns' heights from 0 to 1; without a logarithm, outstanding columns are cut off at 1."""
        if logarithmic:
            heights = np.log1p(self.counts)
            return heights / max(float(heights.max()), 1e-300)
        # The fifth highest column sets the scale: a few values, such as that of air, often exceed all others.
        top = float(np.sort(self.counts)[-min(5, self.counts.size)])
        return np.minimum(self.counts / max(top, 1.0), 1.0)


def histogram_of(volume: Volume) -> Histogram:
    """Return the histogram of a volume's finite values."""
    low, high = volume.finite_range or (0.0, 1.0)
    largest = max(abs(low), abs(high), float(np.finfo(np.float64).tiny))
    if high - low <= _BINS * np.finfo(np.float64).eps * largest:  # too few numbers between low and high
        wide = max(0.5, 1e-3 * max(abs(low), abs(high)))
        low, high = low - wide, high + wide
    low, high = max(low, -_LARGEST), min(high, _LARGEST)
    if not low < high:  # all values exceed _LARGEST
        low, high = -0.5, 0.5
    step = int(np.ceil((volume.size / _MOST_SAMPLES) ** (1 / 3)))
    values = volume.values[::step, ::step, ::step].ravel()
    bins = _BINS
    if values.dtype.kind in "iu" and high - low < _BINS:
        bins = int(high - low) + 1  # one column for each integer
        low, high = low - 0.5, high + 0.5
    if values.dtype.kind == "f":
        values = values[np.isfinite(values)]
    counts, edges = np.histogram(values, bins, (low, high))
    return Histogram(edges.astype(np.float64), counts.astype(np.float64))
