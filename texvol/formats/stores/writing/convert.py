"""Conversion of a volume, or of a whole file, to OME-Zarr, never more of it in memory than allowed.

The metadata that make the folder an image are written last, so that nobody takes an unfinished store for a whole one.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from texvol.formats.stores.writing.journal import Journal
from texvol.formats.stores.writing.levels import _PARTS, ImageWriter, Layout
from texvol.formats.stores.writing.metadata import write_group
from texvol.formats.stores.writing.recording import Recording
from texvol.scene.large_volume import Triple
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, NoRoomError, missing_extra
from texvol.util.memory import free_memory

_VERSION = 3  # of an unfinished conversion's folder


@dataclass(frozen=True)
class Written:
    """Shapes of the levels that were written, and their bytes."""

    shapes: list[Triple]  # of each level of the image, (z, y, x)
    bytes: int


def convert(
    volume: Volume | Recording,
    folder: str | os.PathLike[str],
    *,
    layout: Layout | None = None,
    labels: Mapping[str, Recording] | None = None,
    memory: int | None = None,
    overwrite: bool = False,
    tell: Callable[[float], None] = lambda fraction: None,
) -> Written:
    """Write a volume or a recording as an OME-Zarr store; an interrupted conversion goes on if called again.

    Parameters
    ----------
    folder : path
        Of the store.
    labels : mapping, optional
        Labels that belong to the image, by the names of their groups.
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
    image = volume if isinstance(volume, Recording) else Recording.of(volume)
    room = free_memory() // 2 if memory is None else memory
    try:
        return _Conversion(image, labels or {}, Path(folder), layout or Layout(), room).run(overwrite, tell)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror or error}") from None
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{folder}: cannot be written: {_reason(error)}") from None


class _Conversion:
    def __init__(
        self, image: Recording, labels: Mapping[str, Recording], folder: Path, layout: Layout, memory: int
    ) -> None:
        try:
            import tensorstore
        except ImportError as error:
            raise missing_extra("tensorstore", "zarr", f"{folder}: writing OME-Zarr") from error
        self._tensorstore, self._folder, self._layout = tensorstore, folder, layout
        for name in labels:
            if any(each in ("", ".", "..") for each in name.split("/")):
                raise InputError(f"{image.name}: labels must lie in the store's group labels, got the name {name!r}")
        self._recordings = {"": image} | {f"labels/{name}": each for name, each in labels.items()}
        self._labels = list(labels)
        needed = max(layout.room(each) for each in self._recordings.values())
        if needed > memory:
            raise NoRoomError(
                f"{folder}: memory must have room for {needed / 1e6:.3g} MB, which a shard takes to be made, got "
                f"{memory / 1e6:.3g} MB: allow more by --memory, or choose smaller shards"
            )
        self._context = tensorstore.Context({"cache_pool": {"total_bytes_limit": int((memory - needed) / 2)}})

    def run(self, overwrite: bool, tell: Callable[[float], None]) -> Written:
        journal = Journal(self._folder, self._task(), overwrite)
        writers = {
            group: ImageWriter(each, self._folder, group, self._layout, journal, self._opened)
            for group, each in self._recordings.items()
        }
        total, done = sum(each.samples for each in writers.values()), 0
        for group, writer in writers.items():
            for count in writer.write():
                done += count
                tell(done / total)
            if group:
                writer.end()
        shutil.rmtree(self._folder / _PARTS, ignore_errors=True)
        self._list_labels()
        # Last of all: before it the folder is no image.
        writers[""].end()
        journal.end()
        return Written(writers[""].shapes, _bytes_in(self._folder))

    def _list_labels(self) -> None:
        if not self._labels:
            return
        form, told = self._layout.zarr_format, {"labels": self._labels}
        for name in self._labels:
            for between in list(Path(name).parents)[:-1]:
                write_group(self._folder / "labels" / between, form, None)
        attributes = told if form == 2 else {"ome": {"version": "0.5", **told}}
        write_group(self._folder / "labels", form, attributes)

    def _task(self) -> dict[str, Any]:
        """Return what an unfinished conversion must have begun with, in JSON types."""
        layout = self._layout
        images = {
            group: {**each.identity, "leading": each.leading, "shape": each.form.shape, "dtype": each.dtype.name}
            for group, each in self._recordings.items()
        }
        form = [layout.chunk, layout.written, layout.zarr_format, _VERSION]
        return dict(json.loads(json.dumps({"images": images, "layout": form}, default=_plain)))

    def _opened(self, spec: dict[str, Any]) -> Any:
        return self._tensorstore.open(spec, open=True, create=True, context=self._context).result()


def _plain(thing: Any) -> Any:
    """Return what numpy's numbers and arrays are in JSON; of anything else its words."""
    return thing.tolist() if isinstance(thing, np.ndarray | np.generic) else repr(thing)


def _bytes_in(folder: Path) -> int:
    return sum(each.stat().st_size for each in folder.rglob("*") if each.is_file())


def _reason(error: Exception) -> str:
    from texvol.formats.stores.access import reason_of

    return reason_of(error)
