"""Storage of values in a texture: format, offset and scale, so that single precision keeps the digits that matter.

A texel s stands for the value `offset + scale * s`. Drivers interpolate in float32, which rounds s by up to 2^-24 |s|.
What is drawn depends on the value in a few intervals only, its *features*: where a transfer function rises or falls,
about an isovalue, or where most values lie. Rounding moves a value within the feature [a, b] by at most

    2^-24 κ (b - a),    κ = max(|a - offset|, |b - offset|) / (b - a)

The largest κ of all features is the *condition number* of the storage. A lone sample of 1e8 beside a wave from 0 to 1
does not change κ as long as the offset is near the wave: cells that touch the sample hold values far beyond the
feature, wherever float32 puts them.

Types of 16 bits and less, and float32, are stored as they are, and wider ones about the middle of their range, as long
as κ is small; else as float32 about the offset that makes κ least.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.statistics import distinct

INTEGERS = (np.uint8, np.int8, np.uint16, np.int16)
HUGE = 1e30  # stands for an infinite sample or value: any weight above 1e-24 takes it past every control point
# Stands for a value that is missing: NaN would be so with a weight of 0 as well, and at the edges of a texture drivers
# take a neighbour with that. Hardly a weight is so small that it doesn't take it far past all values that there are.
MISSING = 3e38
ULP = 2.0**-24  # the rounding of a float32, relative to itself
WELL = 256.0  # a condition number of which the rounding, 1.5e-5 of a feature, hides in any picture
_WELL_IN_16_BITS = 2048.0  # beyond it 1.2e-4 of a feature is worth twice the memory
HOPELESS = 2.0**18  # the rounding is a 64th of a feature
# Times the extent of the features: from there on float32's rounding in a cell, 6e-5 of that extent, is beyond that of
# ordinary cells. Where what is drawn begins or ends in such a cell it does so within a thousandth of the cell's face.
FAR = 1024.0
_LARGEST = 1e28  # magnitude of a finite texel: far from HUGE
_LARGEST_BESIDE_INFINITE = 1e18  # likewise, where with a weight of 1e-12 HUGE is to be larger than all that is finite
_LEAST = 1e-20  # width of a feature in texels: of much smaller ones devices take what is left for 0
_CANDIDATES = 32  # features about which an offset is tried, steepest first
_SAMPLES = 4096  # values looked at for where most lie
_FEW, _SELDOM = 16, 64  # different values; one part in so many of all samples
_BULK_WIDTHS = 64.0  # from the middle of the densest half of all values, in widths of that half
_BULK: WeakKeyDictionary[Volume, tuple[float, float]] = WeakKeyDictionary()


@dataclass(frozen=True)
class Features:
    """Intervals of values in which a picture changes: arrays of shape (n,) in data units.

    `widths` is over what distance all of a change would take place at an interval's slope, `highest - lowest` where
    all of it does take place there. `all_shows` where pictures hold the values themselves, also those in no interval.
    """

    lowest: NDArray[np.float64]
    highest: NDArray[np.float64]
    widths: NDArray[np.float64]
    all_shows: bool = False

    def condition(self, offset: float) -> float:
        """Condition number of values stored relative to an offset."""
        with np.errstate(over="ignore"):
            reach = np.maximum(abs(self.lowest - offset), abs(self.highest - offset)) / self.widths
        return float(reach.max(initial=0.0))

    def best_offset(self) -> float:
        """Offset of the least condition number, among the ends and middles of the steepest intervals."""
        steepest = np.argsort(self.widths, kind="stable")[:_CANDIDATES]
        low, high = self.lowest[steepest], self.highest[steepest]
        hull = 0.5 * self.lowest.min() + 0.5 * self.highest.max()
        return min((float(each) for each in [*low, *high, *(0.5 * low + 0.5 * high), hull]), key=self.condition)

    def extent(self, offset: float) -> float:
        """Largest distance of any interval's end from an offset, at least the smallest width; infinite without any."""
        if not self.widths.size:
            return np.inf
        farthest = np.maximum(abs(self.lowest - offset), abs(self.highest - offset)).max()
        return float(max(farthest, self.finest))

    def storage(self, texel_format: str, offset: float, scale: float) -> Storage:
        """Storage in which these are what is drawn."""
        return Storage(texel_format, offset, scale, self.condition(offset), self.extent(offset) / scale)

    @property
    def finest(self) -> float:
        """Smallest of all widths; infinite without any interval."""
        return float(self.widths.min(initial=np.inf))


@dataclass(frozen=True)
class Storage:
    """Texel format of values, and what takes a texel back to data units; `condition` as the module defines it."""

    texel_format: str
    offset: float
    scale: float
    condition: float = 0.0
    extent: float = np.inf  # of the features, in texels
    largest: float = _LARGEST  # magnitude of a finite texel

    def stored(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the texels that stand for values."""
        return (values - self.offset) / self.scale

    def vouches_for_itself(self, volume: Volume) -> bool:
        """True if two pictures of the same texels cannot both be wrong by rounding: it is far below what shows.

        Not so where rounding is coarse beside a feature, nor beside values far beyond all features: cells next to
        these are interpolated with the rounding of large numbers.
        """
        return self.is_well and self.farthest(volume) <= FAR * self.extent

    @property
    def is_well(self) -> bool:
        """True if rounding of values inside the features hides in any picture."""
        return self.condition <= (_WELL_IN_16_BITS if self.texel_format in ("r8", "r16") else WELL)

    def farthest(self, volume: Volume) -> float:
        """Largest magnitude of a volume's finite texels."""
        with np.errstate(over="ignore"):
            ends = np.array(volume.finite_range or (0.0, 0.0)) / self.scale
            return float(np.abs(ends - self.offset / self.scale).max())


def storage_of(volume: Volume, features: Features) -> Storage:
    """Storage of a volume's values, none of them rounded more than to single precision."""
    usual = _usual_storage(volume, features)
    if usual is not None and usual.is_well:
        return usual
    placed = _placed(volume, features)
    return usual if usual is not None and usual.condition <= placed.condition else placed


def other_storage(volume: Volume, features: Features) -> Storage:
    """Storage about another offset and to another scale, so that values are rounded independently of `storage_of`.

    A picture from it differs from the usual one by what rounding does.
    """
    placed = storage_of(volume, features)
    if placed.texel_format != "r32f":
        placed = _placed(volume, features)
    # Not by round numbers, which would move values from one number of float32 to another without rounding.
    offset = placed.offset + 0.3183098861837907 * (features.finest if np.isfinite(features.finest) else placed.scale)
    other = features.storage("r32f", offset, 1.2533141373155 * placed.scale)
    return replace(other, largest=placed.largest)


def stored_values(values: NDArray, storage: Storage) -> NDArray:
    """`values` as a texture holds them, in `storage.texel_format`: of 8 and 16 bits as integers."""
    offset, scale = storage.offset, storage.scale
    if storage.texel_format == "r8":
        return values if values.dtype == np.uint8 else values.view(np.uint8) ^ np.uint8(0x80)
    if storage.texel_format == "r16":
        if values.dtype.itemsize > 2:
            return np.rint((values - offset) * (65535 / scale)).astype(np.uint16)
        if values.dtype == np.uint8:
            wide = values.astype(np.uint16)
            wide *= np.uint16(257)
            return wide
        if values.dtype == np.int8:
            return (values.astype(np.int16) + 128).astype(np.uint16) * np.uint16(257)
        return values if values.dtype == np.uint16 else values.view(np.uint16) ^ np.uint16(0x8000)
    if (offset, scale) == (0.0, 1.0) and values.dtype in (np.float16, np.float32):
        return _finite(values.astype(np.float32) if storage.texel_format == "r32f" else values)
    with np.errstate(over="ignore"):
        placed = (values.astype(np.float64) - offset) / scale
    # Finite values stay apart from what stands for infinities.
    np.clip(placed, -storage.largest, storage.largest, out=placed, where=np.isfinite(values))
    return _finite(placed.astype(np.float32))


def features_of_medium(transfer_function: TransferFunction, volume: Volume) -> Features:
    """Intervals in which a transfer function changes, of the points and of what depends on the gradient.

    An interval in which only a part of all change takes place counts as that much wider. A step counts as wide as most
    values lie apart: rounding moves its position.
    """
    found = [_changes(transfer_function.values, transfer_function.numbers)]
    for graded in transfer_function.graded:
        found.append(_changes(graded.values, np.column_stack([graded.emissions, graded.extinctions])))
    low, high, fraction = (np.concatenate(each) for each in zip(*found, strict=True))
    contours = np.array([each.value for each in transfer_function.contours])
    low, high = np.append(low, contours), np.append(high, contours)
    fraction = np.append(fraction, np.ones(contours.size))
    widths = (high - low) / fraction
    steps = ~(widths > 0)
    if steps.any():
        first, last = bulk_of(volume)
        widths[steps] = (last - first) or max(abs(last), 1.0)
    return Features(low, high, widths)


def features_about(volume: Volume, isovalues: Sequence[float]) -> Features:
    """The interval of most values, or isovalues that each count as wide as that, and as they are far from it."""
    low, high = bulk_of(volume)
    width = (high - low) or max(abs(high), *map(abs, isovalues), 0.0) or 1.0
    if not isovalues:
        lowest, highest, widths = np.array([[low], [high], [width]], np.float64)
        return Features(lowest, highest, widths, all_shows=True)
    values = np.array(isovalues, np.float64)
    return Features(values, values, np.maximum(width, np.maximum(values - high, low - values)), all_shows=False)


def bulk_of(volume: Volume) -> tuple[float, float]:
    """Interval in which most of the different finite values of a volume lie, from a few thousand spread samples.

    The densest half of them, and what is no farther from its middle than 64 times its width: a few far-off samples, or
    many of one far-off value, are outside.
    """
    if volume not in _BULK:
        _BULK[volume] = _bulk(volume)
    return _BULK[volume]


def keep_bulk(volume: Volume, stand_in: Volume) -> None:
    """Have a stand-in that lacks the samples of a volume know the interval of `bulk_of`, if it is known."""
    if volume in _BULK:
        _BULK[stand_in] = _BULK[volume]


def spread_samples(volume: Volume, count: int) -> NDArray[np.intp]:
    """Indices (x, y, z) of samples spread evenly over a volume, shape (count, 3).

    Multiples of 1/g, 1/g², 1/g³ with g⁴ = g + 1 fill the cube evenly (Roberts 2018, the R3 sequence), without the time
    that numpy.random takes to import.
    """
    return (_spread(count) * np.array(volume.dimensions)).astype(np.intp)


@lru_cache(4)  # parts of a large volume ask for the same, each
def _spread(count: int) -> NDArray[np.float64]:
    steps = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    fractions: NDArray[np.float64] = np.arange(1, count + 1)[:, np.newaxis] * steps % 1
    fractions.setflags(write=False)
    return fractions


def _bulk(volume: Volume) -> tuple[float, float]:
    flat = volume.values.reshape(-1)
    if flat.size > _SAMPLES:
        x, y, z = spread_samples(volume, _SAMPLES).T
        flat = volume.values[z, y, x]
    samples = flat.astype(np.float64)
    samples = samples[np.isfinite(samples)]
    values = distinct(samples)
    if values.size <= _FEW:
        # One of few kinds is far off if hardly any sample has it, and not since there are few others.
        often = np.array([np.count_nonzero(samples == each) for each in values]) >= samples.size / _SELDOM
        values = values[often]
    if not values.size:
        return volume.finite_range or (0.0, 0.0)
    half = min(values.size // 2 + 1, values.size)
    first = int(np.argmin(values[half - 1 :] - values[: values.size - half + 1]))
    low, high = values[first], values[first + half - 1]
    middle, reach = 0.5 * low + 0.5 * high, _BULK_WIDTHS * (high - low)
    near = values[abs(values - middle) <= reach] if reach > 0 else values[first : first + half]
    return float(near[0]), float(near[-1])


def _usual_storage(volume: Volume, features: Features) -> Storage | None:
    """Storage as the type suggests, whatever is drawn; None where float32 has no room for the values as they are."""
    dtype = volume.dtype
    if dtype in INTEGERS:
        low, high = float(np.iinfo(dtype).min), float(np.iinfo(dtype).max)
        return features.storage("r16", low, high - low)
    low, high = volume.finite_range or (0.0, 1.0)
    if dtype in (np.float16, np.float32):
        if max(abs(low), abs(high)) > _largest_of(volume) or features.finest < _LEAST:
            return None
        # Half precision has no number that stands out for what is missing or infinite.
        narrow = dtype == np.float16 and not volume.has_missing and volume.value_range == volume.finite_range
        return features.storage("r16f" if narrow else "r32f", 0.0, 1.0)
    offset, scale = low / 2 + high / 2, (high / 2 - low / 2) or 1.0
    return features.storage("r32f", offset, scale) if features.finest / scale >= _LEAST else None


def _placed(volume: Volume, features: Features) -> Storage:
    """Storage in single precision about the features."""
    low, high = volume.finite_range or (0.0, 1.0)
    offset = features.best_offset() if features.widths.size else low / 2 + high / 2
    largest = _largest_of(volume)
    farthest = max(high / largest - offset / largest, offset / largest - low / largest)
    extent = features.extent(offset)
    extent = extent if extent < np.inf else (high / 2 - low / 2) or 1.0
    # Where a far-off value would leave the range of float32 the features go down in it, as far as all digits are kept.
    # Pictures hold no numbers beyond 3.4e38, and show all others.
    most = max(extent * 1e30, 1e40 / largest if features.all_shows else 0.0)
    scale = max(extent, min(farthest, most))
    return replace(features.storage("r32f", offset, scale), largest=largest)


def _largest_of(volume: Volume) -> float:
    """Magnitude that finite texels may have."""
    return _LARGEST if volume.value_range == volume.finite_range else _LARGEST_BESIDE_INFINITE


def _changes(values: NDArray[np.float64], numbers: NDArray[np.float64]) -> tuple[NDArray, NDArray, NDArray]:
    """Ends of the intervals between points in which numbers change, and which fraction of all change each has."""
    if values.size < 2:
        return values[:0], values[:0], values[:0]
    most = np.abs(numbers).max(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        relative = np.where(np.isinf(numbers), 1.0, np.where(most > 0, numbers / most, 0.0))
    fraction = np.abs(np.diff(relative, axis=0)).max(axis=1)
    changing = fraction > 0
    return values[:-1][changing], values[1:][changing], fraction[changing]


def _finite(texels: NDArray) -> NDArray:
    """`texels` with finite stand-ins for infinities and NaN, which would be NaN wherever their weight is 0."""
    if np.isfinite(texels).all():
        return texels
    finite = np.where(np.isinf(texels), np.copysign(np.float32(HUGE), texels), texels)
    return np.where(np.isnan(finite), np.float32(MISSING), finite)
