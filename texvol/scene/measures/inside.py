"""Samples of a volume inside a box along the axes of the world, and their statistics.

A sample is inside if its position is, or lies on a face. Parts with counts n, means m and sums of squared differences
from them M are combined without loss of digits (Chan, Golub and LeVeque 1979):

    m = m1 + (m2 - m1) n2 / n        M = M1 + M2 + (m2 - m1)² n1 n2 / n
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from texvol.scene.large_volume import LargeVolume
from texvol.scene.volume import Volume

_ON_FACE = 1e-6  # of the smallest spacing: a sample that rounding has put so far outside a face lies on the face
_PART = 1 << 20  # samples that are looked at together
_PART_READ = 1 << 24  # samples that are read from a store together


@dataclass
class Statistics:
    """Statistics of samples.

    Attributes
    ----------
    count : int
        Number of samples with a finite value.
    missing : int
        Number of samples that are NaN or infinite.
    mean, lowest, highest : float
        NaN without samples.
    labels : dict
        Number of samples of each label, of a volume of labels.
    """

    count: int = 0
    missing: int = 0
    mean: float = np.nan
    lowest: float = np.nan
    highest: float = np.nan
    labels: dict[int, int] = field(default_factory=dict)
    _squares: float = 0.0

    @property
    def deviation(self) -> float:
        """Standard deviation, √(M / n); NaN without samples."""
        return float(np.sqrt(self._squares / self.count)) if self.count else np.nan

    def add(self, values: NDArray) -> None:
        """Add samples."""
        numbers = values.astype(np.float64).ravel()
        if values.dtype.kind == "f":
            finite = np.isfinite(numbers)
            self.missing += int(numbers.size - np.count_nonzero(finite))
            numbers = numbers[finite]
        if not numbers.size:
            return
        mean = float(numbers.mean())
        squares = float(np.square(numbers - mean).sum())
        before, self.count = self.count, self.count + numbers.size
        apart = mean - self.mean if before else 0.0
        self.mean = self.mean + apart * numbers.size / self.count if before else mean
        self._squares += squares + apart**2 * before * numbers.size / self.count
        self.lowest = float(np.fmin(self.lowest, numbers.min()))
        self.highest = float(np.fmax(self.highest, numbers.max()))

    def add_labels(self, values: NDArray) -> None:
        """Add samples to the numbers of labels."""
        for label, count in zip(*np.unique(values, return_counts=True), strict=True):
            self.labels[int(label)] = self.labels.get(int(label), 0) + int(count)


def statistics_inside(volume: Volume, low: NDArray[np.float64], high: NDArray[np.float64]) -> Statistics:
    """Return the statistics of the samples inside a box of the world from `low` to `high`, each of shape (3)."""
    found = Statistics()
    for values in samples_inside(volume, low, high):
        found.add(values)
        if volume.labels:
            found.add_labels(values)
    found.labels = dict(sorted(found.labels.items()))
    return found


def labels_of_store(volume: LargeVolume) -> dict[int, int]:
    """Return the number of samples of each label, ascending, of which only a part is in memory at a time."""
    found = Statistics()
    for _, values in _parts(volume, np.zeros(3, np.intp), np.array(volume.dimensions)):
        found.add_labels(values)
    return dict(sorted(found.labels.items()))


def samples_inside(volume: Volume, low: NDArray[np.float64], high: NDArray[np.float64]) -> Iterator[NDArray]:
    """Yield the samples inside a box, in parts that stay small."""
    slack = _ON_FACE * volume.smallest_spacing
    low, high = low - slack, high + slack
    first, last = _bounds(volume, low, high)
    if (first >= last).any():
        return
    straight = bool((np.count_nonzero(volume.world_from_index, axis=0) == 1).all())
    for begin, part in _parts(volume, first, last):
        yield part if straight else part[_inside(volume, begin, part.shape, low, high)]


def _bounds(volume: Volume, low: NDArray, high: NDArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first index along x, y, z of samples in the box, and the one behind the last, of the grid's box."""
    ends = np.stack([low, high])
    corners = np.stack(np.meshgrid(*ends.T, indexing="ij"), axis=-1).reshape(-1, 3)
    index = (corners - volume.origin) @ volume.index_from_world.T
    counts = np.array(volume.dimensions)
    first = np.clip(np.ceil(index.min(axis=0)), 0, counts).astype(np.intp)
    last = np.clip(np.floor(index.max(axis=0)) + 1, 0, counts).astype(np.intp)
    return first, last


def _parts(volume: Volume, first: NDArray, last: NDArray) -> Iterator[tuple[NDArray, NDArray]]:
    """Yield the first index along x, y, z and the samples of parts of some layers and rows."""
    in_store = isinstance(volume, LargeVolume)
    most = _PART_READ if in_store else _PART
    width, rows, _ = (int(each) for each in last - first)
    few = max(min(rows, most // width), 1)
    layers = max(most // (width * few), 1)
    for z in range(int(first[2]), int(last[2]), layers):
        above = min(z + layers, int(last[2]))
        for y in range(int(first[1]), int(last[1]), few):
            beyond = min(y + few, int(last[1]))
            begin = np.array([first[0], y, z])
            if isinstance(volume, LargeVolume):
                part = volume.part(0, (int(first[0]), y, z), (int(last[0]), beyond, above)).values
            else:
                part = volume.values[z:above, y:beyond, int(first[0]) : int(last[0])]
            yield begin, part


def _inside(volume: Volume, begin: NDArray, shape: tuple[int, ...], low: NDArray, high: NDArray) -> NDArray[np.bool_]:
    """Return which samples of a part lie in the box."""
    found = np.ones(shape, np.bool_)
    z, y, x = np.ogrid[tuple(slice(0, count) for count in shape)]
    steps = x + begin[0], y + begin[1], z + begin[2]
    for axis in range(3):
        row = volume.world_from_index[axis]
        position = volume.origin[axis] + sum(
            factor * step for factor, step in zip(row, steps, strict=True) if factor != 0
        )
        found &= (position >= low[axis]) & (position <= high[axis])
    return found
