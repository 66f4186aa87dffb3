"""Conversion of a volume to OME-Zarr: shard by shard, level by level, never more of it in memory than allowed.

Each level is made of the one below it, which is read back. The metadata that make the folder an image are written last,
so that nobody takes an unfinished store for a whole one.
"""

from __future__ import annotations

import math
import os
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
from texvol.formats.stores.writing.metadata import array_spec, multiscale, write_group
from texvol.formats.stores.writing.reducing import reduced, statistics
from texvol.scene.large_volume import Box, LargeVolume, Triple
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, NoRoomError, missing_extra
from texvol.util.memory import free_memory

_SMALLEST = 64  # samples along an axis: a level of no more is the last
_PARTS = ".texvol-parts"  # folder of the statistics of each shard, until they are gathered
_GATHERED = 64  # numbers along an axis of a chunk of statistics: 2 MB, so that a distant store is asked for few files
_WORK = 12.0  # times the bytes of a unit's samples that reducing it and its statistics take
Read = Callable[[Box], NDArray]


@dataclass(frozen=True)
class Written:
    """Shapes of the levels that were written, and their bytes."""

    shapes: list[Triple]  # of each level, (z, y, x)
    bytes: int


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


def convert(
    volume: Volume,
    folder: str | os.PathLike[str],
    *,
    layout: Layout | None = None,
    memory: int | None = None,
    overwrite: bool = False,
    tell: Callable[[float], None] = lambda fraction: None,
) -> Written:
    """Write a volume as an OME-Zarr store; an interrupted conversion goes on if called again.

    Parameters
    ----------
    folder : path
        Of the store.
    memory : int, optional
        Bytes that may be used for samples; half of what is free by default.
    overwrite : bool
        True if a store of that name may be replaced.
    tell : callable
        Is told again and again what fraction is done.

    Raises
    ------
    InputError
        If the folder holds something else, or cannot be written.
    NoRoomError
        If memory has no room for a shard.
    MissingExtraError
        If TensorStore is not installed.
    """
    layout = layout or Layout()
    conversion = _Conversion(volume, Path(folder), layout, free_memory() // 2 if memory is None else memory)
    try:
        return conversion.run(overwrite, tell)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror or error}") from None
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{folder}: cannot be written: {_reason(error)}") from None


class _Conversion:
    def __init__(self, volume: Volume, folder: Path, layout: Layout, memory: int) -> None:
        try:
            import tensorstore
        except ImportError as error:
            raise missing_extra("tensorstore", "zarr", f"{folder}: writing OME-Zarr") from error
        self._tensorstore, self._volume, self._folder, self._layout = tensorstore, volume, folder, layout
        self._shapes, self._factors = pyramid(volume)
        self._dtype = volume.dtype
        self._shard = layout.shard if layout.zarr_format == 3 else layout.chunk
        unit = math.prod(c * 2 + 2 for c in layout.chunk) * self._dtype.itemsize * _WORK
        shard = math.prod(min(s, n) for s, n in zip(self._shard, volume.shape, strict=True)) * self._dtype.itemsize
        needed = 3 * shard + unit
        if needed > memory:
            raise NoRoomError(
                f"{folder}: memory must have room for {needed / 1e6:.3g} MB, which a shard takes to be made, got "
                f"{memory / 1e6:.3g} MB: allow more by --memory, or choose smaller shards"
            )
        self._context = tensorstore.Context({"cache_pool": {"total_bytes_limit": int((memory - needed) / 2)}})

    def run(self, overwrite: bool, tell: Callable[[float], None]) -> Written:
        journal = Journal(self._folder, self._task(), overwrite)
        form = self._layout.zarr_format
        write_group(self._folder / GROUP, form, None)
        total = sum(math.prod(shape) for shape in self._shapes)
        done = 0
        for number in range(len(self._shapes)):
            for count in self._write_level(number, journal):
                done += count
                tell(done / total)
        shutil.rmtree(self._folder / _PARTS, ignore_errors=True)
        # Last of all: before it the folder is no image.
        attributes = multiscale(self._volume, self._factors, form)
        write_group(self._folder, form, attributes)
        journal.end()
        return Written(self._shapes, _bytes_in(self._folder))

    def _write_level(self, number: int, journal: Journal) -> Iterator[int]:
        """Write the shards of a level that are not there yet; yield the number of samples of each."""
        shape, chunk = self._shapes[number], self._layout.chunk
        counts = tuple(-(-n // c) for n, c in zip(shape, chunk, strict=True))
        parts = self._folder / _PARTS / f"{number}"
        per_shard = tuple(s // c for s, c in zip(self._shard, chunk, strict=True))
        array = self._opened(self._folder / f"{number}", shape, self._dtype, chunk, self._shard)
        tables = [self._opened(parts / name, counts, np.dtype(np.float64), per_shard, None) for name in ARRAYS]
        read = self._reader(number)
        grid = [range(0, n, s) for n, s in zip(shape, self._shard, strict=True)]
        shards = list(product(*grid))
        for shard, start in enumerate(shards):
            stop = [min(a + s, n) for a, s, n in zip(start, self._shard, shape, strict=True)]
            box = tuple(slice(a, b) for a, b in zip(start, stop, strict=True))
            count = math.prod(b - a for a, b in zip(start, stop, strict=True))
            if not journal.is_done(number, shard):
                values, found = self._made(read if number else _once(read, box, shape), box, shape)
                array[box].write(values).result()
                where = tuple(slice(a // c, -(-b // c)) for a, b, c in zip(start, stop, chunk, strict=True))
                for table, numbers in zip(tables, found, strict=True):
                    table[where].write(numbers).result()
                journal.note(number, shard)
            yield count
        # The journal counts it as one more shard: afterwards the parts may be gone.
        if not journal.is_done(number, len(shards)):
            self._gather(number, counts, tables)
            journal.note(number, len(shards))

    def _gather(self, number: int, counts: tuple[int, ...], tables: list[Any]) -> None:
        """Copy the statistics of a level into few chunks: with one for each shard there would be thousands of files."""
        place = self._folder / GROUP / f"{number}"
        own = {"texvol": {"version": VERSION, "chunk_shape": list(self._layout.chunk)}}
        write_group(place, self._layout.zarr_format, own)
        chunk = tuple(min(count, _GATHERED) for count in counts)
        for name, table in zip(ARRAYS, tables, strict=True):
            gathered = self._opened(place / name, counts, np.dtype(np.float64), chunk, None)
            for start in product(*(range(0, n, c) for n, c in zip(counts, chunk, strict=True))):
                box = tuple(slice(a, min(a + c, n)) for a, c, n in zip(start, chunk, counts, strict=True))
                gathered[box].write(table[box]).result()

    def _made(self, read: Read, box: Any, shape: Triple) -> tuple[NDArray, list[NDArray[np.float64]]]:
        """Return the samples of a shard, and the statistics of its chunks; chunk by chunk."""
        chunk = self._layout.chunk
        values = np.empty([part.stop - part.start for part in box], self._dtype)
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

    def _reader(self, number: int) -> Read:
        """Return the function that reads boxes of a level that is to be written."""
        volume = self._volume
        if number == 0:
            if isinstance(volume, LargeVolume):
                return volume.levels[0].source.read
            return lambda box: volume.values[box]
        below = self._shapes[number - 1]
        factor = tuple(b // a for a, b in zip(self._factors[number - 1], self._factors[number], strict=True))
        array = self._opened(self._folder / f"{number - 1}", below, self._dtype, self._layout.chunk, self._shard)

        def read(box: Box) -> NDArray:
            ends = zip(box, factor, below, strict=True)
            finer = tuple(slice(part.start * f, min(part.stop * f, n)) for part, f, n in ends)
            return reduced(array[finer].read().result(), factor, volume.labels)  # type: ignore[arg-type]

        return read

    def _opened(
        self, place: Path, shape: tuple[int, ...], dtype: np.dtype, chunk: tuple[int, ...], shard: Triple | None
    ) -> Any:
        form = self._layout.zarr_format
        spec = array_spec(place, shape, dtype, chunk, shard if form == 3 else None, form)
        return self._tensorstore.open(spec, open=True, create=True, context=self._context).result()

    def _task(self) -> dict[str, Any]:
        volume, layout = self._volume, self._layout
        told = {key: value for key, value in volume.source.items() if key not in ("path", "memory")}
        stamp: list[float] = []
        if (path := told.get("absolute")) and os.path.isfile(path):
            status = os.stat(path)
            stamp = [status.st_size, status.st_mtime]
        # The last number is the version of an unfinished conversion's folder.
        form = [list(layout.chunk), list(self._shard), layout.zarr_format, 2]
        return {"source": told, "stamp": stamp, "shape": list(volume.shape), "dtype": self._dtype.name, "layout": form}


def _once(read: Read, box: Any, shape: Triple) -> Read:
    """Return a function that reads parts of a shard and its surroundings, which are read at once."""
    around = tuple(slice(max(part.start - 1, 0), min(part.stop + 1, n)) for part, n in zip(box, shape, strict=True))
    samples = read(around)  # type: ignore[arg-type]

    def part_of(part: Box) -> NDArray:
        return samples[tuple(slice(p.start - a.start, p.stop - a.start) for p, a in zip(part, around, strict=True))]

    return part_of


def pyramid(volume: Volume) -> tuple[list[Triple], list[Triple]]:
    """Return the shapes (z, y, x) of the levels, and how many samples of level 0 stand for one of theirs.

    An axis is halved unless its spacing is more than 1.5 times the finest already, so that levels become cubic.
    """
    shape, factor = list(volume.shape), [1, 1, 1]
    spacing = volume.spacing[::-1].copy()
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


def _bytes_in(folder: Path) -> int:
    return sum(each.stat().st_size for each in folder.rglob("*") if each.is_file())


def _reason(error: Exception) -> str:
    from texvol.formats.stores.access import reason_of

    return reason_of(error)
