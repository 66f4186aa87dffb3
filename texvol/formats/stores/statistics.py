"""Statistics of the chunks of a level, where a store has them beside its levels.

The group `texvol-statistics/<path of the level>` has the attribute {"texvol": {"version": 1, "chunk_shape": […]}} and
the arrays of `ChunkStatistics`, float64, with a number for each chunk along every axis of the level's array.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import FileFault
from texvol.formats.stores.access import Store, joined, waited
from texvol.formats.stores.sources import Layout
from texvol.scene.large_volume import ChunkStatistics

GROUP = "texvol-statistics"
VERSION = 1
ARRAYS = ("minimum", "maximum", "variance", "lowest_around", "highest_around")


def statistics_of(store: Store, group: str, key: str, layout: Layout) -> ChunkStatistics | None:
    """Return the statistics of the array `key` of an image's group, or None if the store has none.

    Raises
    ------
    FileFault
        If they are of another version, or do not fit the array.
    """
    place = joined(joined(group, GROUP), key.removeprefix(f"{group}/"))
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
    counts = tuple(-(-size // each) for size, each in zip(layout.sizes, chunk, strict=True))
    chosen = tuple(slice(None) if at is None else at // each for at, each in zip(layout.index, chunk, strict=True))
    opened = store.open_arrays([joined(place, each) for each in ARRAYS])
    for name, each in zip(ARRAYS, opened, strict=True):
        if tuple(each.shape) != counts:
            raise FileFault(f"its {place}/{name} must have shape {counts}, one number for each chunk, got {each.shape}")
        if each.dtype.name != "float64":
            raise FileFault(f"its {place}/{name} must be float64, got {each.dtype.name}")
    futures = [each[chosen].read(order="C") for each in opened]
    parts = [_finished(each, layout, place) for each in futures]
    return ChunkStatistics(layout.spatial(chunk), *parts)


def _finished(future: object, layout: Layout, place: str) -> NDArray[np.float64]:
    found = waited(future, f"its {place}: ")
    return np.ascontiguousarray(layout.turned(np.asarray(found)), np.float64)


def _is_count(thing: object) -> bool:
    return isinstance(thing, int) and not isinstance(thing, bool) and thing > 0
