"""Metadata of an OME-Zarr store as it is written: version 0.5 (Zarr 3), or 0.4 (Zarr 2)."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from texvol.formats.stores.writing.recording import Recording
from texvol.formats.units import time_unit, time_word, unit_word
from texvol.scene.channel import Channel
from texvol.util.color import srgb_from_linear

Range = tuple[float, float]


def multiscale(
    recording: Recording, factors: Sequence[tuple[int, int, int]], zarr_format: int, ranges: Sequence[Range] = ()
) -> dict[str, Any]:
    """Return the attributes of an image's group.

    Parameters
    ----------
    factors : list of (z, y, x)
        Samples of level 0 for one of each level.
    ranges : sequence of (low, high)
        Values that each described channel has.
    """
    form = recording.form
    datasets = []
    start, step = recording.even_times() or (0.0, 1.0)
    before = {"t": (step, start), "c": (1.0, 0.0)}
    leading = [before[axis] for axis in recording.axes]
    spacing, origin = form.spacing[::-1], form.origin[::-1]
    for number, factor in enumerate(factors):
        scale = [each for each, _ in leading] + (spacing * factor).tolist()
        # Halved samples lie in the middle of those that they are means of.
        translation = [each for _, each in leading] + (origin + spacing * (np.array(factor) - 1) / 2).tolist()
        transformations = [{"type": "scale", "scale": scale}, {"type": "translation", "translation": translation}]
        datasets.append({"path": f"{number}", "coordinateTransformations": transformations})
    kind = "mode" if form.labels else "mean"
    image = {"name": recording.title, "axes": _axes(recording), "datasets": datasets, "type": kind}
    more: dict[str, Any] = {}
    if recording.channels:
        more["omero"] = {"channels": [_channel(*each) for each in zip(recording.channels, ranges, strict=True)]}
    if form.labels:
        more["image-label"] = _label(recording, zarr_format)
    if zarr_format == 2:
        return {"multiscales": [image | {"version": "0.4"}], **more, "texvol": _own(recording)}
    return {"ome": {"version": "0.5", "multiscales": [image], **more}, "texvol": _own(recording)}


def _axes(recording: Recording) -> list[dict[str, str]]:
    unit, time = unit_word(recording.form.unit), time_word(recording.time_unit)
    time = time if recording.even_times() is not None else ""
    kinds = {"t": ("time", time), "c": ("channel", "")} | {each: ("space", unit) for each in "zyx"}
    told = [(each, *kinds[each]) for each in f"{recording.axes}zyx"]
    return [{"name": name, "type": kind} | ({"unit": word} if word else {}) for name, kind, word in told]


def _own(recording: Recording) -> dict[str, Any]:
    """Return what OME-Zarr has no words for; texvol reads it."""
    form = recording.form
    own = {"direction": form.direction.tolist(), "space": form.space, "value_unit": form.value_unit}
    if not recording.times:
        return own
    if recording.even_times() is None and np.isfinite(recording.times).all():
        own["times"] = [float(each) for each in recording.times]
    if own.get("times") or time_unit(time_word(recording.time_unit)) != recording.time_unit:
        own["time_unit"] = recording.time_unit
    return own


def _channel(channel: Channel, known: Range) -> dict[str, Any]:
    """Return a channel as `omero` has it, which wants a colour and a window of each."""
    color = (1.0, 1.0, 1.0) if channel.color is None else channel.color
    digits = np.rint(np.clip(srgb_from_linear(np.array(color)), 0, 1) * 255).astype(int)
    start, end = channel.window or known
    window = {"min": min(known[0], start), "max": max(known[1], end), "start": start, "end": end}
    return {
        "label": channel.name or f"channel {channel.number}",
        "color": "".join(f"{each:02X}" for each in digits),
        "window": window,
        "active": channel.active,
    }


def _label(recording: Recording, zarr_format: int) -> dict[str, Any]:
    told = dict(recording.label_attributes or {})
    told.pop("version", None)
    return told | ({"version": "0.4"} if zarr_format == 2 else {})


def write_group(
    folder: Path, zarr_format: int, attributes: dict[str, Any] | None, *, consolidated: bool = False
) -> None:
    """Write the files that make a folder a Zarr group with some attributes.

    With `consolidated` a group of version 3 has the metadata of all nodes in it as well, as zarr-python writes them: a
    distant store is asked for one file in place of each.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if zarr_format == 3:
        content = {"zarr_format": 3, "node_type": "group", "attributes": attributes or {}}
        if consolidated:
            nodes = {path: json.loads(path.read_bytes()) for path in sorted(folder.glob("*/**/zarr.json"))}
            known = {path.parent.relative_to(folder).as_posix(): node for path, node in nodes.items()}
            content["consolidated_metadata"] = {"kind": "inline", "must_understand": False, "metadata": known}
        write_json(folder / "zarr.json", content)
        return
    write_json(folder / ".zgroup", {"zarr_format": 2})
    if attributes is not None:
        write_json(folder / ".zattrs", attributes)


def write_json(path: Path, content: Any) -> None:
    """Write a file of JSON whole or not at all."""
    beside = path.with_name(f"{path.name}.new")
    with open(beside, "w", encoding="utf-8") as file:
        json.dump(content, file, indent=1)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)


def array_spec(
    folder: Path,
    shape: tuple[int, ...],
    dtype: np.dtype,
    chunk: tuple[int, ...],
    shard: tuple[int, ...] | None,
    zarr_format: int,
    names: Sequence[str] = "zyx",
) -> dict[str, Any]:
    """Return TensorStore's specification of an array that is to be made, with axes of these names."""
    store = {"driver": "file", "path": f"{folder}/"}
    if zarr_format == 2:
        compressor = {"id": "zstd", "level": 1}
        metadata: dict[str, Any] = {
            "shape": list(shape), "chunks": list(chunk), "dtype": dtype.newbyteorder("<").str,
            "compressor": compressor, "dimension_separator": "/", "fill_value": 0,
        }  # fmt: skip
        return {"driver": "zarr", "kvstore": store, "metadata": metadata}
    packed: list[dict[str, Any]] = [
        {"name": "bytes", "configuration": {"endian": "little"}},
        {"name": "zstd", "configuration": {"level": 1}},
    ]
    grid = chunk
    if shard is not None:
        index = [{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "crc32c"}]
        inner = {"chunk_shape": list(chunk), "codecs": packed, "index_codecs": index, "index_location": "end"}
        packed, grid = [{"name": "sharding_indexed", "configuration": inner}], shard
    metadata = {
        "shape": list(shape),
        "data_type": dtype.name,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(grid)}},
        "chunk_key_encoding": {"name": "default"},
        "fill_value": 0,
        "codecs": packed,
    }
    return {"driver": "zarr3", "kvstore": store, "metadata": metadata | {"dimension_names": list(names)}}
