"""Metadata of an OME-Zarr store as it is written: version 0.5 (Zarr 3), or 0.4 (Zarr 2)."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from texvol.formats.stores.units import unit_word
from texvol.scene.volume import Volume


def multiscale(volume: Volume, factors: list[tuple[int, int, int]], zarr_format: int) -> dict[str, Any]:
    """Return the attributes of an image's group.

    Parameters
    ----------
    factors : list of (z, y, x)
        Samples of level 0 for one of each level.
    """
    unit = unit_word(volume.unit)
    axes = [{"name": name, "type": "space"} | ({"unit": unit} if unit else {}) for name in "zyx"]
    spacing, origin = volume.spacing[::-1], volume.origin[::-1]
    datasets = []
    for number, factor in enumerate(factors):
        scale = spacing * factor
        # Halved samples lie in the middle of those that they are means of.
        translation = origin + spacing * (np.array(factor) - 1) / 2
        transformations = [
            {"type": "scale", "scale": scale.tolist()},
            {"type": "translation", "translation": translation.tolist()},
        ]
        datasets.append({"path": f"{number}", "coordinateTransformations": transformations})
    name = Path(volume.name).name.split(".")[0]
    image = {"name": name, "axes": axes, "datasets": datasets, "type": "mode" if volume.labels else "mean"}
    own = {"direction": volume.direction.tolist(), "space": volume.space, "value_unit": volume.value_unit}
    more: dict[str, Any] = {"texvol": own}
    if volume.labels:
        more["image-label"] = {"version": "0.4"} if zarr_format == 2 else {}
    if zarr_format == 2:
        return {"multiscales": [image | {"version": "0.4"}], **more}
    label = {"image-label": more.pop("image-label")} if volume.labels else {}
    return {"ome": {"version": "0.5", "multiscales": [image], **label}, **more}


def write_group(folder: Path, zarr_format: int, attributes: dict[str, Any] | None) -> None:
    """Write the files that make a folder a Zarr group with some attributes."""
    folder.mkdir(parents=True, exist_ok=True)
    if zarr_format == 3:
        content = {"zarr_format": 3, "node_type": "group", "attributes": attributes or {}}
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
) -> dict[str, Any]:
    """Return TensorStore's specification of an array that is to be made."""
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
    return {"driver": "zarr3", "kvstore": store, "metadata": metadata | {"dimension_names": ["z", "y", "x"]}}
