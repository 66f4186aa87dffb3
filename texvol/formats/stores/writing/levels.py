"""Levels of one image as they are written: shard by shard, with the statistics of their chunks.

Each level is made of the one below it, which is read back. Time steps and channels are chunks of their own.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.stores.statistics import ARRAYS, GROUP, VERSION
from texvol.formats.stores.writing.journal import Journal
from texvol.formats.stores.writing.metadata import Range, array_spec, multiscale, write_group
from texvol.formats.stores.writing.recording import Form, Part, Recording
from texvol.formats.stores.writing.reducing import reduced, statistics
from texvol.scene.large_volume import Box, LargeVolume, Triple
from texvol.util.errors import InputError

_SMALLEST = 64  # samples along an axis: a level of no more is the last
_PARTS = ".texvol-parts"  # folder of the statistics of each shard, until they are gathered
_GATHERED = 64  # numbers along an axis of a chunk of statistics: 2 MB, so that a distant store is asked for few files
_WORK = 12.0  # times the bytes of a unit's samples that reducing it and its statistics take
_KNOWN_BITS = 16  # of whole numbers whose type is a range to show
Read = Callable[[Box], NDArray]


@dataclass(frozen=True)
class Layout:
    """Chunks and shards of a store, (z, y, x), and its Zarr format."""

    chunk: Triple = (64, 64, 64)
    shard: Triple = (256, 256, 256)
    zarr_format: int = 3

    def __post_init__(self) -> None:
        if self.zarr_format not in (2, 3):
            raise InputError(f"Zarr format must be 2 or 3, got {self.zarr_format}")
        if min(self.chunk) < 1 or any(s % c for s, c in zip(self.shard, self.chunk, strict=True)):
            raise InputError(f"shards must be whole numbers of chunks, got {self.shard} of {self.chunk} samples")

    @property
    def written(self) -> Triple:
        """Samples that are written at once: a shard, or in Zarr 2 a chunk."""
        return self.shard if self.zarr_format == 3 else self.chunk

    def room(self, recording: Recording) -> int:
        """Return the bytes that a shard of a recording takes to be made."""
        size, shape = recording.dtype.itemsize, recording.form.shape
        unit = math.prod(c * 2 + 2 for c in self.chunk) * size * _WORK
        shard = math.prod(min(s, n) for s, n in zip(self.written, shape, strict=True)) * size
        return int(3 * shard + unit)


class ImageWriter:
    """Writer of the levels of a recording into a group of a store.

    Parameters
    ----------
    store : Path
        Folder of the store.
    group : str
        The image's in it: "" or "labels/nuclei".
    open_array : callable
        Opens an array by TensorStore's specification, or makes it.
    """

    def __init__(
        self, recording: Recording, store: Path, group: str, layout: Layout, journal: Journal,
        open_array: Callable[[dict[str, Any]], Any],
    ) -> None:  # fmt: skip
        self._recording, self._layout, self._journal, self._open = recording, layout, journal, open_array
        self._folder = store / group if group else store
        self._parts = store / _PARTS / group if group else store / _PARTS / "image"
        self._group = group
        self._alone = (1,) * len(recording.leading)
        self.shapes, self._factors = pyramid(recording.form)

    @property
    def samples(self) -> int:
        """Number of samples of all levels."""
        return self._recording.count * sum(math.prod(shape) for shape in self.shapes)

    def write(self) -> Iterator[int]:
        """Write what is not there yet; yield the number of samples of each shard."""
        for level in range(len(self.shapes)):
            yield from self._write_level(level)

    def end(self) -> None:
        """Write the metadata that make the group an image."""
        form = self._layout.zarr_format
        attributes = multiscale(self._recording, self._factors, form, self._ranges())
        write_group(self._folder, form, attributes, consolidated=not self._group)

    def _write_level(self, level: int) -> Iterator[int]:
        shape, chunk, leading = self.shapes[level], self._layout.chunk, self._recording.leading
        counts = tuple(-(-n // c) for n, c in zip(shape, chunk, strict=True))
        array = self._opened(level)
        per_shard = tuple(s // c for s, c in zip(self._layout.written, chunk, strict=True))
        below = self._opened(level - 1) if level else None
        tables = [self._table(self._parts / f"{level}" / name, counts, per_shard) for name in ARRAYS]
        key = f"{self._group}/{level}".lstrip("/")
        done = self._journal.done(key)
        grid = [range(0, n, s) for n, s in zip(shape, self._layout.written, strict=True)]
        number = -1
        for number, place in enumerate(product(*map(range, leading), *grid)):
            part, start = place[: len(leading)], place[len(leading) :]
            stop = [min(a + s, n) for a, s, n in zip(start, self._layout.written, shape, strict=True)]
            box = tuple(slice(a, b) for a, b in zip(start, stop, strict=True))
            if number >= done:
                read = self._reader(level, part, below)
                values, found = self._made(read if level else _once(read, box, shape), box, shape)
                array[(*part, *box)].write(values).result()
                where = tuple(slice(a // c, -(-b // c)) for a, b, c in zip(start, stop, chunk, strict=True))
                for table, numbers in zip(tables, found, strict=True):
                    table[(*part, *where)].write(numbers).result()
                self._journal.note(key)
            yield math.prod(b - a for a, b in zip(start, stop, strict=True))
        # The journal counts it as one more shard: afterwards the parts may be gone.
        if done <= number + 1:
            self._gather(level, counts, tables)
            self._journal.note(key)
            shutil.rmtree(self._parts / f"{level}", ignore_errors=True)

    def _gather(self, level: int, counts: tuple[int, ...], tables: list[Any]) -> None:
        """Copy the statistics of a level into few chunks: with one for each shard there would be thousands of files."""
        leading, chunk = self._recording.leading, [*self._alone, *self._layout.chunk]
        place, form = self._folder / GROUP / f"{level}", self._layout.zarr_format
        own = {
            "version": VERSION,
            "chunk_shape": chunk,
            "shape": [*leading, *self.shapes[level]],
            "data_type": self._recording.dtype.name,
        }
        write_group(self._folder / GROUP, form, None)
        write_group(place, form, {"texvol": own})
        size = tuple(min(count, _GATHERED) for count in counts)
        for name, table in zip(ARRAYS, tables, strict=True):
            gathered = self._table(place / name, counts, size)
            for position in product(*map(range, leading), *(range(0, n, c) for n, c in zip(counts, size, strict=True))):
                part, start = position[: len(leading)], position[len(leading) :]
                box = (*part, *(slice(a, min(a + c, n)) for a, c, n in zip(start, size, counts, strict=True)))
                gathered[box].write(table[box]).result()

    def _made(self, read: Read, box: Any, shape: Triple) -> tuple[NDArray, list[NDArray[np.float64]]]:
        """Return the samples of a shard, and the statistics of its chunks; chunk by chunk."""
        chunk = self._layout.chunk
        values = np.empty([part.stop - part.start for part in box], self._recording.dtype)
        found = [np.empty([-(-n // c) for n, c in zip(values.shape, chunk, strict=True)]) for _ in ARRAYS]
        for position in np.ndindex(*found[0].shape):
            start = [part.start + i * c for part, i, c in zip(box, position, chunk, strict=True)]
            stop = [min(a + c, part.stop) for a, c, part in zip(start, chunk, box, strict=True)]
            before = tuple(int(a > 0) for a in start)
            after = tuple(int(b < n) for b, n in zip(stop, shape, strict=True))
            around = tuple(slice(a - m, b + k) for a, b, m, k in zip(start, stop, before, after, strict=True))
            samples = read(around)  # type: ignore[arg-type]
            inner = tuple(slice(m, n - k) for m, k, n in zip(before, after, samples.shape, strict=True))
            into = tuple(slice(a - part.start, b - part.start) for a, b, part in zip(start, stop, box, strict=True))
            values[into] = samples[inner]
            for table, numbers in zip(found, statistics(samples, (before, after), chunk), strict=True):  # type: ignore[arg-type]
                table[position] = numbers.item()
        return values, found

    def _reader(self, level: int, part: Part, finer: Any) -> Read:
        """Return the function that reads boxes of a part of a level that is to be written."""
        if level == 0:
            volume = self._recording.volume(part)
            if isinstance(volume, LargeVolume):
                return volume.levels[0].source.read
            return lambda box: volume.values[box]
        below = self.shapes[level - 1]
        factor = tuple(b // a for a, b in zip(self._factors[level - 1], self._factors[level], strict=True))
        labels = self._recording.form.labels

        def read(box: Box) -> NDArray:
            ends = zip(box, factor, below, strict=True)
            inside = tuple(slice(each.start * f, min(each.stop * f, n)) for each, f, n in ends)
            return reduced(finer[(*part, *inside)].read().result(), factor, labels)  # type: ignore[arg-type]

        return read

    def _ranges(self) -> list[Range]:
        """Return the range of the values of each channel that is described: of their type, or as they are."""
        return [self._range(channel.number) for channel in self._recording.channels]

    def _range(self, channel: int) -> Range:
        kind, found = self._recording.dtype, self._recording.channels[channel]
        if kind.kind in "iu" and kind.itemsize * 8 <= _KNOWN_BITS and found.window is not None:
            return float(np.iinfo(kind).min), float(np.iinfo(kind).max)
        low, high = math.inf, -math.inf
        counts = tuple(-(-n // c) for n, c in zip(self.shapes[0], self._layout.chunk, strict=True))
        size = tuple(min(count, _GATHERED) for count in counts)
        ends = [self._table(self._folder / GROUP / "0" / name, counts, size) for name in ("minimum", "maximum")]
        for part in self._recording.parts():
            if part[self._recording.axes.index("c")] == channel:
                lows, highs = (np.asarray(each[part].read().result()) for each in ends)
                finite = np.isfinite(lows) & np.isfinite(highs)
                low = min(low, float(lows[finite].min(initial=low)))
                high = max(high, float(highs[finite].max(initial=high)))
        return (low, high) if low < high else (low, low + 1.0) if math.isfinite(low) else (0.0, 1.0)

    def _opened(self, level: int) -> Any:
        chunk, shard = ((*self._alone, *each) for each in (self._layout.chunk, self._layout.shard))
        return self._array(self._folder / f"{level}", self.shapes[level], self._recording.dtype, chunk, shard)

    def _table(self, place: Path, counts: tuple[int, ...], chunk: tuple[int, ...]) -> Any:
        return self._array(place, counts, np.dtype(np.float64), (*self._alone, *chunk), None)

    def _array(
        self, place: Path, shape: tuple[int, ...], dtype: np.dtype, chunk: tuple[int, ...],
        shard: tuple[int, ...] | None,
    ) -> Any:  # fmt: skip
        form, leading = self._layout.zarr_format, self._recording.leading
        names = f"{self._recording.axes}zyx"
        return self._open(
            array_spec(place, (*leading, *shape), dtype, chunk, shard if form == 3 else None, form, names)
        )


def _once(read: Read, box: Any, shape: Triple) -> Read:
    """Return a function that reads parts of a shard and its surroundings, which are read at once."""
    around = tuple(slice(max(part.start - 1, 0), min(part.stop + 1, n)) for part, n in zip(box, shape, strict=True))
    samples = read(around)  # type: ignore[arg-type]

    def part_of(part: Box) -> NDArray:
        return samples[tuple(slice(p.start - a.start, p.stop - a.start) for p, a in zip(part, around, strict=True))]

    return part_of


def pyramid(form: Form) -> tuple[list[Triple], list[Triple]]:
    """Return the shapes (z, y, x) of the levels, and how many samples of level 0 stand for one of theirs.

    An axis is halved unless its spacing is more than 1.5 times the finest already, so that levels become cubic.
    """
    shape, factor = list(form.shape), [1, 1, 1]
    spacing = form.spacing[::-1].copy()
    shapes, factors = [_triple(shape)], [_triple(factor)]
    while max(shape) > _SMALLEST:
        finest = min(spacing[axis] for axis in range(3) if shape[axis] > 1)
        for axis in range(3):
            if shape[axis] > 1 and spacing[axis] <= 1.5 * finest:
                shape[axis], factor[axis] = -(-shape[axis] // 2), factor[axis] * 2
                spacing[axis] *= 2
        shapes.append(_triple(shape))
        factors.append(_triple(factor))
    return shapes, factors


def _triple(numbers: list[int]) -> Triple:
    z, y, x = numbers
    return z, y, x
