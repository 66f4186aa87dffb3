"""Statistics of the chunks of a level, where a store has them beside its levels.

The group `texvol-statistics/<path of the level>` has the attribute {"texvol": {"version": 1, "chunk_shape": […]}} and
the arrays of `ChunkStatistics`, float64, with a number for each chunk along every axis of the level's array.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

import numpy as np

from texvol.formats.readers.samples import FileFault
from texvol.formats.stores.access import Store, joined, waited
from texvol.formats.stores.sources import Layout
from texvol.scene.large_volume import ChunkStatistics
from texvol.util.errors import InputError

GROUP = "texvol-statistics"
VERSION = 1
ARRAYS = ("minimum", "maximum", "variance", "lowest_around", "highest_around")


class StoredStatistics(ChunkStatistics):
    """Statistics of a level that are read when they are first asked for, or when they are told to `begin`.

    A picture asks for those of few levels, and each array is a file of its own.

    Parameters
    ----------
    store : Store
    name : str
        Of the store in messages.
    place : str
        Key of the group that they are in.
    layout : Layout
        Of the level's array.
    chunk : list of int
        Samples along the axes of that array that each number is of.
    """

    _store: Store
    _name: str
    _place: str
    _layout: Layout
    _chunk: list[int]
    _coming: dict[str, Any]  # futures of the arrays, by their names
    _lock: threading.Lock

    def __init__(self, store: Store, name: str, place: str, layout: Layout, chunk: list[int]) -> None:
        self.__dict__ |= {"chunk_shape": layout.spatial(chunk), "_store": store, "_name": name, "_place": place}
        self.__dict__ |= {"_layout": layout, "_chunk": chunk, "_coming": {}, "_lock": threading.Lock()}

    def begin(self) -> None:
        """Begin to read all arrays in the background; raise FileFault if they do not fit the level."""
        with self._lock:
            if self._coming:
                return
            opened = self._store.open_arrays([joined(self._place, each) for each in ARRAYS])
            self._coming |= dict(zip(ARRAYS, _started(opened, self._place, self._layout, self._chunk), strict=True))

    def __getattr__(self, name: str) -> Any:
        """Return an array that has not been asked for before; raise InputError if it cannot be read."""
        if name not in ARRAYS:
            raise AttributeError(name)
        try:
            self.begin()
            found = waited(self._coming[name], f"its {self._place}: ")
        except FileFault as fault:
            raise InputError(f"{self._name}: {fault}") from None
        self.__dict__[name] = np.ascontiguousarray(self._layout.turned(np.asarray(found)), np.float64)
        return self.__dict__[name]

    def __reduce__(self) -> tuple[Any, ...]:
        return ChunkStatistics, (self.chunk_shape, *(getattr(self, name) for name in ARRAYS))


def statistics_of(
    store: Store, name: str, group: str, keys: Sequence[str], layouts: Sequence[Layout]
) -> list[ChunkStatistics | None]:
    """Return the statistics of the arrays `keys` of an image's group; None for an array without statistics.

    Those of the first begin to be read. `name` is that of the store in messages.

    Raises
    ------
    FileFault
        If they are of another version, or those of the first array do not fit it.
    """
    places = [joined(joined(group, GROUP), key.removeprefix(f"{group}/")) for key in keys]
    store.look_up([joined(place, "zarr.json") for place in places])
    chunks = [_chunk_shape(store, place, layout) for place, layout in zip(places, layouts, strict=True)]
    found = [
        None if chunk is None else StoredStatistics(store, name, place, layout, chunk)
        for place, layout, chunk in zip(places, layouts, chunks, strict=True)
    ]
    if found and found[0] is not None:
        found[0].begin()
    return list(found)


def _chunk_shape(store: Store, place: str, layout: Layout) -> list[int] | None:
    """Return the chunk shape that the statistics in a group are of; None if there are no statistics."""
    attributes = store.attributes(place)
    if attributes is None:
        return None
    told = attributes.get("texvol")
    if not isinstance(told, dict) or told.get("version") != VERSION:
        version = told.get("version") if isinstance(told, dict) else None
        raise FileFault(f"its {place} must be statistics of version {VERSION}, got version {version}")
    chunk = told.get("chunk_shape")
    if not isinstance(chunk, list) or len(chunk) != len(layout.sizes) or not all(_is_count(each) for each in chunk):
        raise FileFault(f"its {place} must have a chunk_shape of {len(layout.sizes)} numbers, got {chunk!r}")
    return chunk


def _started(opened: list[Any], place: str, layout: Layout, chunk: list[int]) -> list[Any]:
    """Begin to read the statistics of one level from its opened arrays; return their futures."""
    counts = tuple(-(-size // each) for size, each in zip(layout.sizes, chunk, strict=True))
    chosen = tuple(slice(None) if at is None else at // each for at, each in zip(layout.index, chunk, strict=True))
    for name, each in zip(ARRAYS, opened, strict=True):
        if tuple(each.shape) != counts:
            raise FileFault(f"its {place}/{name} must have shape {counts}, one number for each chunk, got {each.shape}")
        if each.dtype.name != "float64":
            raise FileFault(f"its {place}/{name} must be float64, got {each.dtype.name}")
    return [each[chosen].read(order="C") for each in opened]


def _is_count(thing: object) -> bool:
    return isinstance(thing, int) and not isinstance(thing, bool) and thing > 0
