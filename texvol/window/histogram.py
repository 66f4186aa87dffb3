"""How many samples have which value, for the editor and for window and level."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume

_BINS = 256
_MOST_SAMPLES = 1 << 22  # beyond, every n-th: a picture of 256 columns does not tell the difference
_LARGEST = 0.4 * float(np.finfo(np.float64).max)  # so that the distance of two edges is a number


@dataclass(frozen=True)
class Histogram:
    """Counts between edges.

    Attributes
    ----------
    edges : array of shape (bins + 1)
    counts : array of shape (bins)
    """

    edges: NDArray[np.float64]
    counts: NDArray[np.float64]

    def heights(self, logarithmic: bool) -> NDArray[np.float64]:
        """Of the columns, the highest 1; linear ones leave out what a single value, such as air, towers over."""
        if logarithmic:
            heights = np.log1p(self.counts)
            return heights / max(float(heights.max()), 1e-300)
        # The second highest column of the rest, not the background's spike, fills the room.
        top = float(np.sort(self.counts)[-min(5, self.counts.size)])
        return np.minimum(self.counts / max(top, 1.0), 1.0)


def histogram_of(volume: Volume) -> Histogram:
    """The histogram of a volume's finite values."""
    low, high = volume.finite_range or (0.0, 1.0)
    largest = max(abs(low), abs(high), float(np.finfo(np.float64).tiny))
    if high - low <= _BINS * np.finfo(np.float64).eps * largest:  # no room for as many columns between numbers
        wide = max(0.5, 1e-3 * max(abs(low), abs(high)))
        low, high = low - wide, high + wide
    low, high = max(low, -_LARGEST), min(high, _LARGEST)
    if not low < high:  # all are beyond
        low, high = -0.5, 0.5
    step = int(np.ceil((volume.values.size / _MOST_SAMPLES) ** (1 / 3)))
    values = volume.values[::step, ::step, ::step].ravel()
    bins = _BINS
    if values.dtype.kind in "iu" and high - low < _BINS:
        bins = int(high - low) + 1  # one for each value
        low, high = low - 0.5, high + 0.5
    if values.dtype.kind == "f":
        values = values[np.isfinite(values)]
    counts, edges = np.histogram(values, bins, (low, high))
    return Histogram(edges.astype(np.float64), counts.astype(np.float64))
