"""Units of the numbers in a transfer-function file, some of them relative to a volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.spaces import letters_of_space
from texvol.scene.transfer.pieces import LARGEST_VALUE
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.statistics import histogram, percentile_of_sorted

CHOICES = {
    "values": ("data", "percentile", "range", "matter"),
    "length": ("world", "box", "spacing", "cell"),
    "gradients": ("data", "relative", "voxel"),
}
_STATISTICS_SAMPLES = 1 << 16  # samples that percentiles are taken from; their error is 0.2 of a percentile
_GOLDEN = (5**0.5 - 1) / 2  # φ, whose multiples by squares have no period
_LOST, _HIGHEST_END = 8, 40  # bins of 64
_LOWER_SIDES = 3.0  # of a background, above its mode: Rayleigh's noise has fallen to less than a twentieth of it there
_RISES, _SURE = 1.3, 4.0  # of the valley before it, and standard deviations: a peak
_FAR = 3.0  # ranges of all others above them, from which on samples are of an object that is small and bright
_LEAST_OBJECT = 27  # samples of it
_COHERENT = 0.5  # least fraction of them beside another one: noise and hot pixels are alone


@dataclass(frozen=True)
class Units:
    """Conversion of the numbers of a file to data and world units; see `texvol.scene.transfer.files`."""

    volume: Volume | None  # what they are relative to, needed as soon as one is
    values: str = "data"
    length: str = "world"
    gradients: str = "data"

    def placed(self, values: ArrayLike) -> NDArray[np.float64]:
        """Values in data units, in their order."""
        values = np.asarray(values, np.float64)
        if self.values == "data":
            return values
        if self.volume is not None and self.volume.labels:
            raise InputError(f'values in "{self.values}" need measured values, got labels in {self.volume.name}')
        if self.values == "percentile":
            if not ((values >= 0) & (values <= 100)).all():
                raise InputError("percentiles must be from 0 to 100")
            return percentile_of_sorted(typical_samples(self.known_volume), values)
        low, high = self.known_volume.finite_range or (0.0, 1.0)
        if self.values == "matter":
            low, high = medium_range(self.known_volume)
        return np.clip(low * (1 - values) + high * values, -LARGEST_VALUE, LARGEST_VALUE)

    @property
    def per_length(self) -> float:
        """Factor of extinctions and emissions."""
        if self.length == "world":
            return 1.0
        if self.length == "spacing":
            return 1.0 / self.known_volume.smallest_spacing
        if self.length == "cell":
            return 1.0 / _mean_cell(self.known_volume)
        return 1.0 / float(np.linalg.norm(self.known_volume.box_edges, axis=0).mean())

    @property
    def per_gradient(self) -> float:
        """Factor of gradient magnitudes; positive."""
        if self.gradients == "data":
            return 1.0
        if self.gradients == "voxel":
            return 1.0 / float(self.known_volume.spacing.mean())
        low, high = self.known_volume.finite_range or (0.0, 0.0)
        spacing = self.known_volume.smallest_spacing
        return max(high / spacing - low / spacing, 1e-300)

    @property
    def known_volume(self) -> Volume:
        """The volume, or InputError."""
        if self.volume is None:
            needed = "a volume must be given, load(path, volume), since the units depend on it"
            raise InputError(f"{needed} (texvol convert-tf: --volume VOLUME)")
        return self.volume


def _mean_cell(volume: Volume) -> float:
    """Mean edge of the cells between samples: the diagonal over the cube root of their number, as ParaView's."""
    cells = np.maximum(np.array(volume.dimensions) - 1, 0)
    diagonal = float(np.linalg.norm(cells * volume.spacing))
    return diagonal / float(np.cbrt(np.prod(np.maximum(cells, 1), dtype=np.float64))) or volume.smallest_spacing


def typical_samples(volume: Volume) -> NDArray[np.float64]:
    """Finite samples spread over the volume, at most 65,536 of them, ascending; (0,) where none is finite.

    One of each run of samples in memory is taken, at a fraction {k²φ} of the k-th run: a stride alone may visit a plane
    of the volume that misses what is in its middle, such as x + z = y of 256³ samples. Of a volume in a store they are
    those of a coarse level: all of its samples need not fit in memory.
    """
    volume = volume.overview
    flat = volume.values.reshape(-1)
    run = -(-flat.size // _STATISTICS_SAMPLES)
    begins = np.arange(0, flat.size, run)
    within = (np.arange(begins.size, dtype=np.float64) ** 2 * _GOLDEN % 1 * run).astype(np.intp)
    samples = flat[np.minimum(begins + within, flat.size - 1)].astype(np.float64)
    samples = samples[np.isfinite(samples)]
    if not samples.size and volume.finite_range:
        samples = np.array(volume.finite_range)
    return np.sort(samples) if samples.size else np.zeros(1)


def medium_range(volume: Volume) -> tuple[float, float]:
    """Values between which the volume's medium lies: from where its background ends to its 99.9th percentile.

    The background is the value that most samples have, if it is near the low end and stands for at least a twentieth
    of them; without one the range starts at the 5th percentile. Where a small object is far brighter than that range,
    all else is its background.
    """
    samples = typical_samples(volume)
    largest = max(float(np.abs(samples).max()), 1e-300)
    is_body = letters_of_space(volume.space) is not None
    low, high = _range_of_medium(samples / largest, is_body)  # values up to 1e308 have no range that float64 could hold
    return _range_of_object(volume, float(samples[0]), high * largest) or (low * largest, high * largest)


def _range_of_object(volume: Volume, lowest: float, high: float) -> tuple[float, float] | None:
    """Return the range of an object that is too small for percentiles, and far above all other values; else None."""
    width = high - lowest
    beyond = high + _FAR * width
    if volume.labels or not (volume.finite_range and 0 < width < np.inf and volume.finite_range[1] > beyond):
        return None
    values = volume.overview.values
    far = values > beyond
    count = int(far.sum())
    if count < _LEAST_OBJECT or int((far[..., 1:] & far[..., :-1]).sum()) < _COHERENT * count:
        return None
    # A long tail of the others has more samples near them than far from them.
    if 2 * int(((values > high + width / 2) & (values <= beyond)).sum()) > count:
        return None
    of_object = np.sort(values[far].astype(np.float64))
    return high, float(percentile_of_sorted(of_object[np.isfinite(of_object)], 90))


def _range_of_medium(samples: NDArray[np.float64], is_body: bool) -> tuple[float, float]:
    low, high = percentile_of_sorted(samples, (0.1, 99.9))
    if not high > low:
        low, high = samples[0], samples[-1]
    if not high > low:
        return low - 0.5, low + 0.5  # a constant volume lies in the middle of its range
    counts, edges = histogram(samples, 64, (low, high))
    mode = int(counts[:24].argmax())
    if counts[mode] < samples.size / 20:
        return float(percentile_of_sorted(samples, 5)), float(high)
    end = _end_of_background(counts, mode)
    low = float(edges[end])
    if end >= mode + _LOST and not is_body:  # around a body is air, however noisy
        low = min(low, _mirrored(samples, edges[mode : mode + 2]))
    return low, float(high)


def _mirrored(samples: NDArray[np.float64], peak: NDArray[np.float64]) -> float:
    """Return the end of a background by its lower side, for one that passes into the medium without a valley.

    `peak` are the ends of the bin with most samples; the background's own mode is looked for between them.
    """
    counts, edges = histogram(samples, 64, (float(peak[0]), float(peak[1])))
    mode = float(edges[counts.argmax() + 1])
    return max(mode + _LOWER_SIDES * (mode - float(percentile_of_sorted(samples, 0.1))), float(peak[1]))


def _end_of_background(counts: NDArray[np.intp], mode: int) -> int:
    """Return the bin in which the peak of the background has fallen to a twentieth, or before another one to a third.

    A broad background has not fallen as far where the medium's own peak begins: then it ends in the valley between,
    if a large part of the medium would be lost otherwise.
    """
    beyond = np.flatnonzero(counts[mode:_HIGHEST_END] < counts[mode] / 20)
    end = mode + int(beyond[0]) if beyond.size else mode + 1
    for valley in range(mode + 1, end - _LOST + 1 if beyond.size else _HIGHEST_END):
        low = float(counts[valley])
        if low < counts[mode] / 3 and low <= counts[mode : valley + 1].min():
            peak = float(counts[valley + 1 :].max(initial=0))
            if peak > _RISES * low + _SURE * np.sqrt(peak):
                return valley
    return end
