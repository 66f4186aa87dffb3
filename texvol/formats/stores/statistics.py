"""Statistics of the chunks of a level, where a store has them beside its levels.

The group `texvol-statistics/<path of the level>` has the attribute {"texvol": {"version": 1, "chunk_shape": […]}} and
the arrays of `ChunkStatistics`, float64, with a number for each chunk along every axis of the level's array.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import FileFault
from texvol.formats.stores.access import Store, joined, waited
from texvol.formats.stores.sources import Layout
from texvol.scene.large_volume import ChunkStatistics

GROUP = "texvol-statistics"
VERSION = 1
ARRAYS = ("minimum", "maximum", "variance", "lowest_around", "highest_around")


def statistics_of(
    store: Store, group: str, keys: Sequence[str], layouts: Sequence[Layout]
) -> list[ChunkStatistics | None]:
    """Return the statistics of the arrays `keys` of an image's group; None for an array without statistics.

    All arrays are read at the same time: a distant store takes a round trip for each that is read alone.

    Raises
    ------
    FileFault
        If they are of another version, or do not fit the array.
    """
    places = [joined(joined(group, GROUP), key.removeprefix(f"{group}/")) for key in keys]
    store.look_up([joined(place, "zarr.json") for place in places])
    chunks = [_chunk_shape(store, place, layout) for place, layout in zip(places, layouts, strict=True)]
    known = [each for each in zip(places, layouts, chunks, strict=True) if each[2] is not None]
    opened = iter(store.open_arrays([joined(place, name) for place, _, _ in known for name in ARRAYS]))
    coming = {place: _started(opened, place, layout, chunk) for place, layout, chunk in known if chunk is not None}
    return [
        None
        if chunk is None
        else ChunkStatistics(layout.spatial(chunk), *(_finished(each, layout, place) for each in coming[place]))
        for place, layout, chunk in zip(places, layouts, chunks, strict=True)
    ]


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


def _started(opened: Iterator[Any], place: str, layout: Layout, chunk: list[int]) -> list[Any]:
    """Start to read the statistics of one level, from the next opened arrays; return their futures."""
    counts = tuple(-(-size // each) for size, each in zip(layout.sizes, chunk, strict=True))
    chosen = tuple(slice(None) if at is None else at // each for at, each in zip(layout.index, chunk, strict=True))
    coming = []
    for name in ARRAYS:
        each = next(opened)
        if tuple(each.shape) != counts:
            raise FileFault(f"its {place}/{name} must have shape {counts}, one number for each chunk, got {each.shape}")
        if each.dtype.name != "float64":
            raise FileFault(f"its {place}/{name} must be float64, got {each.dtype.name}")
        coming.append(each[chosen].read(order="C"))
    return coming


def _finished(future: object, layout: Layout, place: str) -> NDArray[np.float64]:
    found = waited(future, f"its {place}: ")
    return np.ascontiguousarray(layout.turned(np.asarray(found)), np.float64)


def _is_count(thing: object) -> bool:
    return isinstance(thing, int) and not isinstance(thing, bool) and thing > 0
