"""Statistics of the chunks of a level, where a store has them beside its levels.

The group `texvol-statistics/<path of the level>` has the attribute {"texvol": {"version": 1, "chunk_shape": […],
"shape": […], "data_type": …}} and the arrays of `ChunkStatistics`, float64, with a number for each chunk along every
axis of the level's array. Where these are not what the array has, another tool has written it anew: such statistics are
not used. Stores of earlier versions have the chunk shape only.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.readers.samples import FileFault
from texvol.formats.stores.access import Store, joined, waited
from texvol.formats.stores.sources import ChunkedSource, Layout
from texvol.scene.large_volume import ChunkStatistics

GROUP = "texvol-statistics"
VERSION = 1
ARRAYS = ("minimum", "maximum", "variance", "lowest_around", "highest_around")


def statistics_of(
    store: Store, group: str, keys: Sequence[str], sources: Sequence[ChunkedSource]
) -> tuple[list[ChunkStatistics | None], tuple[str, ...]]:
    """Return the statistics of the arrays `keys` of an image's group, None for an array without, and notes.

    Statistics that are of other chunks, another shape or another type than the array are left out, with a note. All
    arrays are read at the same time: a distant store takes a round trip for each that is read alone.

    Raises
    ------
    FileFault
        If they are of another version, or do not fit what they say they are of.
    """
    places = [joined(joined(group, GROUP), key.removeprefix(f"{group}/")) for key in keys]
    store.look_up([joined(place, "zarr.json") for place in places])
    told = [_told(store, place) for place in places]
    stale = [each and _change(each, source) for each, source in zip(told, sources, strict=True)]
    notes = tuple(
        f"its {place} is left out: it is of {change}; another program has written the array since"
        for place, change in zip(places, stale, strict=True)
        if change
    )
    layouts = [source.layout for source in sources]
    chunks = [
        None if each is None or change else [min(pair) for pair in zip(each["chunk_shape"], layout.sizes, strict=True)]
        for each, change, layout in zip(told, stale, layouts, strict=True)
    ]
    known = [place for place, chunk in zip(places, chunks, strict=True) if chunk is not None]
    opened = iter(store.open_arrays([joined(place, name) for place in known for name in ARRAYS]))
    coming = {
        place: _started(opened, place, layout, chunk)
        for place, layout, chunk in zip(places, layouts, chunks, strict=True)
        if chunk is not None
    }
    found = [
        None
        if chunk is None
        else ChunkStatistics(layout.spatial(chunk), *(_finished(each, layout, place) for each in coming[place]))
        for place, layout, chunk in zip(places, layouts, chunks, strict=True)
    ]
    return found, notes


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
