"""HDF5: one dataset, which --variable names if several could be volumes; read by h5py, one thread at a time."""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.channels import described, note, with_first
from texvol.formats.readers.child_process import check_survived
from texvol.formats.readers.samples import Choice, FileFault, Samples, check_chunk, once
from texvol.formats.stores.hdf5_attributes import grid_of, marks_of
from texvol.formats.stores.placing import layout_of, letters_of
from texvol.formats.stores.sources import ChunkedSource, Layout, Reading, check_chunks, check_sizes, sample_type
from texvol.scene.large_volume import Level

# h5py's library has one lock of its own, too; this one also keeps a file from being closed while it is read.
LOCK = threading.RLock()
_MOST_NAMED = 12
_MOST_LOOKED_AT = 10_000  # objects of a file
_SLABS = 64  # samples along an axis that count as a chunk where the file has none


@dataclass(eq=False)
class Hdf5Source(ChunkedSource):
    """Samples of an HDF5 dataset."""

    dataset: Any
    _read: float = 0

    @classmethod
    def of(cls, dataset: Any, layout: Layout, level: str, reading: Reading) -> Hdf5Source:
        """Return the samples of an open dataset; raise FileFault if these are no real numbers."""
        check_sizes(layout.sizes)
        dtype = sample_type(dataset.dtype, str(dataset.dtype))
        chunk = dataset.chunks or tuple(min(size, _SLABS) for size in dataset.shape)
        check_chunk(chunk, dtype.itemsize)
        check_chunks(layout, chunk)
        return cls(layout, dtype, tuple(chunk), level, reading, dataset)

    def __getstate__(self) -> dict[str, Any]:
        return super().__getstate__() | {"dataset": (self.dataset.file.filename, self.dataset.name)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        path, name = state["dataset"]
        super().__setstate__(state | {"dataset": opened(path)[name]})

    @property
    def bytes_read(self) -> int:
        """Bytes that have been read so far: of each chunk the mean that the dataset takes in its file."""
        return int(self._read)

    def stored_bytes(self) -> int | None:
        """Return the bytes that the dataset takes in its file."""
        with LOCK:
            return int(self.dataset.id.get_storage_size())

    def fetch(self, index: tuple[int | slice, ...]) -> NDArray:
        """Return a part of the dataset; raise FileFault if a chunk cannot be read."""
        with LOCK:
            try:
                found = np.asarray(self.dataset[index])
            except (OSError, RuntimeError, ValueError, KeyError) as error:
                raise FileFault(" ".join(str(error).split()) or type(error).__name__) from None
            self._read += self._stored(index)
        return found.astype(found.dtype.newbyteorder("="), copy=False)

    def _stored(self, index: tuple[int | slice, ...]) -> float:
        touched = 1.0
        for each, size, chunk in zip(index, self.dataset.shape, self.stored_chunk, strict=True):
            low, high = (each.start, each.stop) if isinstance(each, slice) else (each, each + 1)
            step = chunk if self.dataset.chunks else 1
            touched *= min(-(-high // step) * step, size) - low // step * step
        return self.dataset.id.get_storage_size() * touched / math.prod(self.dataset.shape)


def opened(path: str) -> Any:
    """Return an open file; raise FileFault if it is damaged."""
    import h5py

    # What is damaged may end the process that opens it.
    check_survived(lambda: h5py.File(os.path.abspath(path), "r").close())
    with LOCK:
        return h5py.File(os.path.abspath(path), "r")


def read(path: str, choice: Choice) -> Samples:
    """Return the level of one dataset."""
    file = once(choice, "file", lambda: opened(path))
    dataset, about = once(choice, "dataset", lambda: _chosen(file, choice.variable))
    names = _names(dataset)
    letters = letters_of(names)
    choice = with_first(letters, dataset.shape, choice)
    layout = layout_of(letters, dataset.shape, choice, [each or "-" for each in names])
    with LOCK:
        grid, notes = grid_of(dataset, layout)
        marks = () if choice.labels else marks_of(dataset)
    reading = Reading(path, (*choice.missing, *marks), bool(choice.missing_chunks))
    channels = described(letters, dataset.shape)
    channel = channels[choice.channel] if channels and choice.channel is not None else None
    levels = (Level(Hdf5Source.of(dataset, layout, "level 0", reading)),)
    notes = (*about, *notes, *note(channels, choice.channel))
    return Samples.of_levels(levels, **grid, notes=notes, channels=channels, channel=channel)


def _chosen(file: Any, wanted: str | None) -> tuple[Any, tuple[str, ...]]:
    """Return the dataset of that path, or the only one that could be a volume."""
    import h5py

    if wanted is not None:
        found = file.get(wanted)
        if not isinstance(found, h5py.Dataset):
            raise FileFault(f"has no dataset {wanted} (--variable); it has {_listed(_volumes(file))}")
        if not found.shape:
            raise FileFault(f"must have axes, got {'nothing' if found.shape is None else 'a single value'}")
        return found, ()
    known = _volumes(file)
    if len(known) != 1:
        several = f"has {len(known)} datasets that could be volumes: {_listed(known)}; --variable NAME chooses one"
        raise FileFault(several if known else "has no dataset of numbers with three axes")
    return file[known[0]], (f"dataset {known[0]}",)


def _volumes(file: Any) -> list[str]:
    """Return the paths of datasets of numbers with three axes or more, in the order of their names."""
    import h5py

    found: list[str] = []
    seen = 0

    def look(name: str, thing: Any) -> bool | None:
        nonlocal seen
        seen += 1
        if isinstance(thing, h5py.Dataset) and thing.dtype.kind in "iufb" and len(thing.shape or ()) >= 3:
            found.append(f"/{name}")
        return True if seen > _MOST_LOOKED_AT else None

    with LOCK:
        file.visititems(look)
    return found


def _names(dataset: Any) -> list[str | None]:
    """Return the labels of a dataset's axes, or the names of its dimension scales."""
    with LOCK:
        found: list[str | None] = []
        for each in dataset.dims:
            scale = each[0].name.rpartition("/")[2] if len(each) else None
            found.append(str(each.label) or scale or None)
        return found


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMED
    return (", ".join(names[:_MOST_NAMED]) or "none") + (f" and {more} more" if more > 0 else "")
