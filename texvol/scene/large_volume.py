"""A LargeVolume is a Volume whose samples stay in a store until they are asked for, at several levels of resolution.

Sample (i, j, k) of a level lies at index

    first + factor * (i, j, k)

of level 0, the finest, along each of x, y, z. Halved by plain averages a level has the factor 2 and its first sample at
1/2. The box is that of level 0; what a level lacks of it, or has beyond, is cut off or continued by its last samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.channel import Channel
from texvol.scene.volume import OF_PLACE, Volume
from texvol.util.errors import InputError
from texvol.util.kept_arrays import Unchanged
from texvol.util.memory import free_memory
from texvol.util.remarks import Noted, make_at_end

Triple = tuple[int, int, int]
Box = tuple[slice, slice, slice]  # of samples, along z, y, x
_DERIVED = *OF_PLACE, "overview", "_overview_level", "whole", "value_range", "has_missing", "finite_range"
_LOOKED_AT = 1 << 21  # samples that are read to know what values there are


class SampleSource(Protocol):
    """Samples of one level in a store; methods may be called by several threads at once."""

    @property
    def shape(self) -> Triple:
        """Numbers of samples (nz, ny, nx)."""

    @property
    def dtype(self) -> np.dtype:
        """Type of the samples: real, of at most 64 bits, in native byte order."""

    @property
    def chunk_shape(self) -> Triple:
        """Numbers of samples (z, y, x) that are decoded at once."""

    @property
    def bytes_read(self) -> int:
        """Bytes that have been read from the store so far, as they are stored."""

    def read(self, box: Box) -> NDArray:
        """Return the samples of a box, whose slices have ends within the shape and no step.

        Raises
        ------
        InputError
            If a chunk cannot be read; the message names it.
        """


@dataclass(frozen=True)
class ChunkStatistics:
    """Least and largest value and variance of each box of `chunk_shape` samples (z, y, x), NaN aside.

    Arrays of shape (cz, cy, cx), float64; NaN where every sample is NaN. `lowest_around` and `highest_around` are those
    of the box and the next sample beyond it on every side, between which all interpolated values in it lie.
    """

    chunk_shape: Triple
    minimum: NDArray[np.float64]
    maximum: NDArray[np.float64]
    variance: NDArray[np.float64]
    lowest_around: NDArray[np.float64]
    highest_around: NDArray[np.float64]


@dataclass(frozen=True)
class Level:
    """Samples of a volume at one resolution."""

    source: SampleSource
    factor: tuple[float, float, float] = (1.0, 1.0, 1.0)  # samples of level 0 for one of its own, along x, y, z
    first: tuple[float, float, float] = (0.0, 0.0, 0.0)  # where its sample (0, 0, 0) lies, in indices of level 0
    statistics: ChunkStatistics | None = None

    @property
    def bytes(self) -> int:
        """Bytes of all its samples in memory."""
        return int(np.prod(self.source.shape, dtype=np.int64)) * self.source.dtype.itemsize


class LargeVolume(Volume):
    """Volume whose samples are read from a store when they are asked for.

    It is a `Volume` in all that concerns its place in the world. `values` reads all samples of level 0, if they fit in
    `memory`; pictures of its medium read the parts and levels that they show.

    Parameters
    ----------
    levels : sequence of Level
        Finest first.
    spacing, origin, direction
        Of level 0, as of `Volume`.
    memory : int, optional
        Bytes of samples that may be held in memory; half of what is free by default.
    unit, value_unit, space, name, source, notes, labels
        As of `Volume`; `notes` also name the chunks that turned out to be missing, and what the `check` finds.
    channel : Channel, optional
        Which of the `channels` of an image it is, if that has several.
    images : sequence of str
        Names of the images in its store.
    times : sequence of float
        Times of all steps in its store, in `time_unit`.
    check : optional
        Has notes on levels that lie elsewhere than they say; it may read samples for them, and is asked late.

    Raises
    ------
    InputError
        As `Volume`; or if there is no level.
    """

    def __init__(
        self,
        levels: Sequence[Level],
        spacing: ArrayLike = (1.0, 1.0, 1.0),
        origin: ArrayLike = (0.0, 0.0, 0.0),
        direction: ArrayLike | None = None,
        *,
        memory: int | None = None,
        unit: str = "",
        value_unit: str = "",
        space: str = "",
        name: str = "volume",
        source: Mapping[str, Any] | None = None,
        notes: Sequence[str] = (),
        labels: bool = False,
        blocks: bool = False,
        channel: Channel | None = None,
        channels: Sequence[Channel] = (),
        images: Sequence[str] = (),
        times: Sequence[float] | None = None,
        time_unit: str = "",
        check: Noted | None = None,
    ) -> None:
        self.name, self.levels, self.resampling, self.colors = name, tuple(levels), None, None
        self.channel, self.channels, self.images = channel, tuple(channels), tuple(images)
        self.times, self.time_unit, self._check = tuple(times or ()), time_unit, check
        if not self.levels:
            raise InputError(f"{name}: a volume must have a level of samples, got none")
        for level in self.levels:
            _check_source(level.source, name)
        self.memory = free_memory() // 2 if memory is None else memory
        self.in_parts = False  # True if it is drawn part by part although all of it fits in memory
        self.cut_for: int | None = None  # memory by which it is cut into regions, if that is not `memory`
        self.labels, self.blocks = labels, blocks
        self._place(spacing, origin, direction)
        self._describe(unit, value_unit, space, source, notes)
        self._unchanged = Unchanged()
        self._coming: Any = None  # samples of `overview` that are on the way

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "whole"} | {"_coming": None}

    @property
    def notes(self) -> tuple[str, ...]:
        """Choices of the reader, chunks that turned out to be missing so far, and levels that lie elsewhere."""
        missing = (note for each in self.levels for note in getattr(each.source, "notes", ()))
        return (*self._notes, *(self._check.notes if self._check else ()), *missing)

    @notes.setter
    def notes(self, notes: Sequence[str]) -> None:
        self._notes = tuple(notes)

    @property
    def values(self) -> NDArray:  # type: ignore[override]
        """All samples of level 0, see `whole`."""
        return self.whole.values

    @cached_property
    def whole(self) -> Volume:
        """Volume of all samples of level 0 in memory, read when first asked for.

        Raises
        ------
        InputError
            If they take more than `memory`, or cannot be read.
        """
        if (needed := self.levels[0].bytes) > self.memory:
            raise InputError(
                f"{self.name}: needs all {needed / 1e9:.3g} GB of its samples at once, and memory has room for "
                f"{self.memory / 1e9:.3g} GB: choose a coarser level by --level, or allow more by --memory"
            )
        return self.part(0, (0, 0, 0), self.dimensions)

    @property
    def shape(self) -> Triple:
        """Numbers of samples (nz, ny, nx) of level 0."""
        return self.levels[0].source.shape

    @property
    def dtype(self) -> np.dtype:
        """Type of the samples."""
        return self.levels[0].source.dtype

    def part(self, level: int, first: Triple, last: Triple) -> Volume:
        """Read the samples first … last - 1 of a level, along x, y, z, as a volume where they lie in the world."""
        return self.placed(level, first, self.levels[level].source.read(_box_of(first, last)))

    def placed(self, level: int, first: Triple, values: NDArray) -> Volume:
        """Return samples of a level from `first` on, along x, y, z, as a volume where they lie in the world."""
        own = self.levels[level]
        start = np.array(own.first) + np.array(own.factor) * first
        made = Volume(
            values,
            (self.spacing * own.factor).tolist(),
            (self.origin + self.world_from_index @ start).tolist(),
            self.direction,
            unit=self.unit,
            value_unit=self.value_unit,
            space=self.space,
            name=self.name,
            source=self.source,  # nobody else has the samples
            labels=self.labels,
            blocks=self.blocks,
            label_table=self.label_table,
        )
        made.channel, made.channels = self.channel, self.channels
        return made

    def at_level(self, number: int) -> LargeVolume:
        """Return the volume whose level 0 is one of the levels.

        Raises
        ------
        InputError
            If there is no such level.
        """
        if not 0 <= number < len(self.levels):
            raise InputError(f"{self.name}: level must be from 0 to {len(self.levels) - 1}, got {number}")
        if number == 0:
            return self
        base = self.levels[number]
        factor, first = np.array(base.factor), np.array(base.first)
        other = copy(self)
        other._coming = None
        for derived in _DERIVED:
            other.__dict__.pop(derived, None)
        other.levels = tuple(
            replace(
                each,
                factor=tuple((np.array(each.factor) / factor).tolist()),
                first=tuple(((np.array(each.first) - first) / factor).tolist()),
            )
            for each in self.levels[number:]
        )
        other._place(
            (self.spacing * factor).tolist(), (self.origin + self.world_from_index @ first).tolist(), self.direction
        )
        other.source = {**self.source, "level": number + self.source.get("level", 0)} if self.source else {}
        return other

    @cached_property
    def overview(self) -> Volume:
        """A coarse level of at most two million samples, in memory; or that many of the middle of the coarsest."""
        number, first, last = self._looked_at
        coming, self._coming = self._coming, None
        return self.part(number, first, last) if coming is None else self.placed(number, first, coming.result())

    def expect_picture(self) -> None:
        """Begin to read what every picture asks for in the background, if the source can: a distant one takes its time.

        That is `overview`, and then the finest level's statistics, of which the longer way is that of the overview.
        """
        number, first, last = self._looked_at
        begin = getattr(self.levels[number].source, "begin", None)
        if begin is not None and self._coming is None and "overview" not in vars(self):
            self._coming = begin(_box_of(first, last))
        if (begin := getattr(self.levels[0].statistics, "begin", None)) is not None:
            begin()

    @property
    def _looked_at(self) -> tuple[int, Triple, Triple]:
        """Level of `overview`, its first sample and the one behind its last, along x, y, z."""
        number = self._overview_level
        dimensions = np.array(self.levels[number].source.shape[::-1])
        most = dimensions.copy()
        while np.prod(most, dtype=float) > _LOOKED_AT:
            most[most.argmax()] = (most.max() + 1) // 2
        first = (dimensions - most) // 2
        return number, _triple_of(first), _triple_of(first + most)

    @property
    def level_in_memory(self) -> int | None:
        """The level of which the overview holds all samples; None if that is none."""
        number = self._overview_level
        return number if np.prod(self.levels[number].source.shape, dtype=float) <= _LOOKED_AT else None

    @cached_property
    def _overview_level(self) -> int:
        sizes = [np.prod(level.source.shape, dtype=float) for level in self.levels]
        fitting = [n for n, size in enumerate(sizes) if size <= _LOOKED_AT and (n > 0 or len(sizes) == 1)]
        return fitting[0] if fitting else len(self.levels) - 1

    @cached_property
    def value_range(self) -> tuple[float, float] | None:
        """Smallest and largest value: of all samples where the store tells them, else of `overview`."""
        statistics = self.levels[0].statistics
        if statistics is None:
            return self.overview.value_range
        if np.isnan(statistics.minimum).all():
            return None
        return float(np.nanmin(statistics.minimum)), float(np.nanmax(statistics.maximum))

    @cached_property
    def has_missing(self) -> bool:
        """True if any sample that is known is NaN."""
        return self.dtype.kind == "f" and self.overview.has_missing

    @cached_property
    def finite_range(self) -> tuple[float, float] | None:
        """Smallest and largest finite value that is known."""
        known = self.value_range
        return known if known is None or np.isfinite(known).all() else self.overview.finite_range

    def remark_on_levels(self) -> None:
        """Have the command that runs tell at its end if coarse levels, which it draws, lie elsewhere than they say."""
        if self._check is not None:
            make_at_end(self._check)

    def check_unchanged(self) -> None:
        """Do nothing: a store's samples are nobody else's."""


def _check_source(source: SampleSource, name: str) -> None:
    if source.dtype.kind not in "iuf" or source.dtype.itemsize > 8:
        raise InputError(f"{name}: values must be real numbers of at most 64 bits, got {source.dtype}")
    if len(source.shape) != 3 or min(source.shape) < 1:
        raise InputError(f"{name}: values must have 3 axes (z, y, x) of at least one sample, got shape {source.shape}")


def _box_of(first: Triple, last: Triple) -> Box:
    z, y, x = (slice(a, b) for a, b in zip(first[::-1], last[::-1], strict=True))
    return z, y, x


def _triple_of(numbers: NDArray[np.intp]) -> Triple:
    x, y, z = (int(number) for number in numbers)
    return x, y, z
