"""Metadata of a store of chunks: levels, channels, images and times."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from texvol.formats.stores.sources import ChunkedSource
from texvol.scene.channel import Channel
from texvol.scene.large_volume import LargeVolume, Level
from texvol.scene.volume import Volume
from texvol.util.color import srgb_from_linear

_MOST_TIMES = 8  # listed


def store_metadata(volume: Volume) -> dict[str, Any] | None:
    """Return metadata that JSON can hold, or None for a volume that is not in a store; triples are x, y, z."""
    if not isinstance(volume, LargeVolume):
        return None
    return {
        "levels": [_level(volume, each) for each in volume.levels],
        "channel": None if volume.channel is None else volume.channel.number,
        "channels": [_channel(each) for each in volume.channels],
        "images": list(volume.images),
        "times": list(volume.times),
        "time_unit": volume.time_unit,
        "bytes_read": sum(each.source.bytes_read for each in volume.levels),
    }


def store_rows(store: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield rows of the page of `texvol info`."""
    for number, each in enumerate(store["levels"]):
        spacing = " x ".join(f"{one:.6g}" for one in each["spacing"])
        shards = "" if each["shard"] == each["chunk"] else f" in shards of {_by(each['shard'])}"
        packed = "" if each["stored_bytes"] is None else f", {each['stored_bytes'] / 1e6:.3g} MB stored"
        statistics = ", with statistics" if each["statistics"] else ""
        yield (
            f"level {number}",
            f"{_by(each['dimensions'])} of {each['type']}, spacing {spacing}, chunks of {_by(each['chunk'])}{shards}"
            f"{packed}{statistics}",
        )
    for each in store["channels"] if len(store["channels"]) > 1 else []:
        window = "" if each["window"] is None else f", {each['window'][0]:g} to {each['window'][1]:g}"
        named = " ".join(word for word in (each["name"], each["color"]) if word) or "no name"
        yield f"channel {each['number']}", f"{named}{window}{'' if each['active'] else ', not active'}"
    if len(store["images"]) > 1:
        yield "images", ", ".join(store["images"])
    if len(store["times"]) > 1:
        listed = ", ".join(f"{each:g}" for each in store["times"][:_MOST_TIMES])
        more = f" … {store['times'][-1]:g}" if len(store["times"]) > _MOST_TIMES else ""
        yield "times", f"{len(store['times'])}: {listed}{more} {store['time_unit']}".rstrip()


def _level(volume: LargeVolume, level: Level) -> dict[str, Any]:
    source = level.source
    found = {
        "dimensions": list(source.shape[::-1]),
        "type": source.dtype.name,
        "spacing": (volume.spacing * level.factor).tolist(),
        "origin": (volume.origin + volume.world_from_index @ np.array(level.first)).tolist(),
        "chunk": list(source.chunk_shape[::-1]),
        "shard": list(source.chunk_shape[::-1]),
        "stored_bytes": None,
        "statistics": level.statistics is not None,
    }
    if isinstance(source, ChunkedSource):
        shard = source.layout.spatial(source.shard_shape)
        if shard != source.layout.spatial(source.stored_chunk):
            found["shard"] = list(shard[::-1])
        found["stored_bytes"] = source.stored_bytes()
    return found


def _channel(channel: Channel) -> dict[str, Any]:
    color = channel.color
    found = channel._asdict()
    if color is not None:
        bytes_of = np.rint(srgb_from_linear(np.array(color)) * 255).astype(int)
        found["color"] = "#" + "".join(f"{each:02x}" for each in bytes_of)
    return found | {"window": None if channel.window is None else list(channel.window)}


def _by(sizes: list[int]) -> str:
    return " x ".join(map(str, sizes))
