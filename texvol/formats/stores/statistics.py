"""Statistics of the chunks of a level, where a store has them beside its levels.

The group `texvol-statistics/<path of the level>` has the attribute {"texvol": {"version": 1, "chunk_shape": […],
"shape": […], "data_type": …}} and the arrays of `ChunkStatistics`, float64, with a number for each chunk along every
axis of the level's array. Where these are not what the array has, another tool has written it anew: such statistics are
not used. Stores of earlier versions have the chunk shape only.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

import numpy as np

from texvol.formats.readers.samples import FileFault
from texvol.formats.stores.access import Store, joined, waited
from texvol.formats.stores.sources import ChunkedSource, Layout
from texvol.scene.large_volume import ChunkStatistics
from texvol.util.errors import InputError

GROUP = "texvol-statistics"
VERSION = 1
ARRAYS = ("minimum", "maximum", "variance", "lowest_around", "highest_around")


class StoredStatistics(ChunkStatistics):
    """Statistics of a level that are read when they are first asked for, or are to `begin`.

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
    _opened: list[Any]  # arrays, when they have been opened
    _coming: dict[str, Any]  # futures of the arrays, by their names
    _lock: threading.Lock

    def __init__(self, store: Store, name: str, place: str, layout: Layout, chunk: list[int]) -> None:
        self.__dict__ |= {"chunk_shape": layout.spatial(chunk), "_store": store, "_name": name, "_place": place}
        self.__dict__ |= {"_layout": layout, "_chunk": chunk, "_opened": [], "_coming": {}, "_lock": threading.Lock()}

    def open(self) -> None:
        """Open all arrays; raise FileFault if they do not fit the level."""
        with self._lock:
            if not self._opened:
                opened = self._store.open_arrays([joined(self._place, each) for each in ARRAYS])
                self._opened += _checked(opened, self._place, self._layout, self._chunk)

    def begin(self) -> None:
        """Begin to read all arrays in the background; raise InputError if they do not fit the level."""
        try:
            self.open()
        except FileFault as fault:
            raise InputError(f"{self._name}: {fault}") from None
        with self._lock:
            if not self._coming:
                self._coming |= {name: each.read(order="C") for name, each in zip(ARRAYS, self._opened, strict=True)}

    def __getattr__(self, name: str) -> Any:
        """Return an array that has not been asked for before; raise InputError if it cannot be read."""
        if name not in ARRAYS:
            raise AttributeError(name)
        self.begin()
        try:
            found = waited(self._coming[name], f"its {self._place}: ")
        except FileFault as fault:
            raise InputError(f"{self._name}: {fault}") from None
        self.__dict__[name] = np.ascontiguousarray(self._layout.turned(np.asarray(found)), np.float64)
        return self.__dict__[name]

    def __reduce__(self) -> tuple[Any, ...]:
        return ChunkStatistics, (self.chunk_shape, *(getattr(self, name) for name in ARRAYS))


def statistics_of(
    store: Store, name: str, group: str, keys: Sequence[str], sources: Sequence[ChunkedSource]
) -> tuple[list[ChunkStatistics | None], tuple[str, ...]]:
    """Return the statistics of the arrays `keys` of an image's group, None for an array without, and notes.

    Statistics that are of other chunks, another shape or another type than the array are left out, with a note. `name`
    is that of the store in messages.

    Raises
    ------
    FileFault
        If they are of another version, or those of the first array do not fit what they say they are of.
    """
    places = [joined(joined(group, GROUP), key.removeprefix(f"{group}/")) for key in keys]
    store.look_up([joined(place, "zarr.json") for place in places])
    found: list[ChunkStatistics | None] = []
    notes = []
    for place, source in zip(places, sources, strict=True):
        told, layout = _told(store, place), source.layout
        change = "" if told is None else _change(told, source)
        if change:
            notes.append(f"its {place} is left out: it is of {change}; another program has written the array since")
        if told is None or change:
            found.append(None)
            continue
        chunk = [min(pair) for pair in zip(told["chunk_shape"], layout.sizes, strict=True)]
        found.append(StoredStatistics(store, name, place, layout, chunk))
    if found and isinstance(found[0], StoredStatistics):
        found[0].open()
    return found, tuple(notes)


def _told(store: Store, place: str) -> dict[str, Any] | None:
    """Return what the statistics in a group say they are of; None if there are no statistics."""
    attributes = store.attributes(place)
    if attributes is None:
        return None
    told = attributes.get("texvol")
    if not isinstance(told, dict) or told.get("version") != VERSION:
        version = told.get("version") if isinstance(told, dict) else None
        raise FileFault(f"its {place} must be statistics of version {VERSION}, got version {version}")
    chunk = told.get("chunk_shape")
    if not isinstance(chunk, list) or not all(_is_count(each) for each in chunk):
        raise FileFault(f"its {place} must have a chunk_shape of whole numbers, got {chunk!r}")
    return told


def _change(told: dict[str, Any], source: ChunkedSource) -> str:
    """Return in words how the array differs from what its statistics are of; "" if it does not."""
    sizes = source.layout.sizes
    # Chunks that are longer than the array are as good as any other.
    theirs, own = ([min(pair) for pair in zip(each, sizes, strict=False)]
                   for each in (told["chunk_shape"], source.stored_chunk))  # fmt: skip
    if len(told["chunk_shape"]) != len(sizes) or theirs != own:
        return f"chunks of {_by(told['chunk_shape'])}, and the array has chunks of {_by(source.stored_chunk)}"
    if told.get("shape", list(sizes)) != list(sizes):
        return f"an array of {_by(told['shape'])}, and the array has {_by(sizes)}"
    if told.get("data_type", source.stored_type.name) != source.stored_type.name:
        return f"values of type {told['data_type']}, and the array has {source.stored_type.name}"
    return ""


def _by(numbers: Any) -> str:
    return " x ".join(map(str, numbers)) if isinstance(numbers, list | tuple) else repr(numbers)


def _checked(opened: list[Any], place: str, layout: Layout, chunk: list[int]) -> list[Any]:
    """Return the part that a level has of its opened arrays; raise FileFault if they do not fit it."""
    counts = tuple(-(-size // each) for size, each in zip(layout.sizes, chunk, strict=True))
    chosen = tuple(slice(None) if at is None else at // each for at, each in zip(layout.index, chunk, strict=True))
    for name, each in zip(ARRAYS, opened, strict=True):
        if tuple(each.shape) != counts:
            raise FileFault(f"its {place}/{name} must have shape {counts}, one number for each chunk, got {each.shape}")
        if each.dtype.name != "float64":
            raise FileFault(f"its {place}/{name} must be float64, got {each.dtype.name}")
    return [each[chosen] for each in opened]


def _is_count(thing: object) -> bool:
    return isinstance(thing, int) and not isinstance(thing, bool) and thing > 0
