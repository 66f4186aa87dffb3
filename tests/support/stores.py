"""Stores of chunks as other software writes them, and servers of the loopback that hand them out."""

from __future__ import annotations

import http.server
import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import zarr
from numpy.typing import NDArray

SPACING = (0.5, 1.0, 2.0)  # x, y, z
ORIGIN = (5.0, 3.0, -1.0)


def field(size: int = 48, dtype: str = "uint16") -> NDArray:
    """A smooth field with structure along all axes, shape (size, size - 4, size + 4)."""
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in (size, size - 4, size + 4)), indexing="ij")
    values = 150 * np.exp(-3 * (x * x + y * y + z * z)) + 30 * np.sin(8 * x) * np.cos(6 * y + 2 * z) + 60
    return values.astype(dtype)


def halved(values: NDArray) -> NDArray:
    """Averages of 2 x 2 x 2 samples of the last three axes."""
    nz, ny, nx = (each // 2 for each in values.shape[-3:])
    even = values[..., : 2 * nz, : 2 * ny, : 2 * nx]
    parts = even.reshape(*values.shape[:-3], nz, 2, ny, 2, nx, 2)
    return parts.mean((-5, -3, -1)).astype(values.dtype)


def transformations(scale: Sequence[float], translation: Sequence[float] | None) -> list[dict[str, Any]]:
    """coordinateTransformations of a dataset."""
    found: list[dict[str, Any]] = [{"type": "scale", "scale": list(map(float, scale))}]
    return found + (
        [] if translation is None else [{"type": "translation", "translation": list(map(float, translation))}]
    )


def write_ome(
    path: Path,
    values: NDArray,
    *,
    version: str = "0.5",
    axes: str = "zyx",
    levels: int = 3,
    chunk: int = 16,
    shard: int | None = None,
    omero: list[dict[str, Any]] | None = None,
    shift: float | None = 0.5,
    down: Any = halved,
    more: dict[str, Any] | None = None,
    group: str = "",
    **array: Any,
) -> Path:
    """Write a pyramid with zarr-python; `values` have the axes sorted as "tczyx", the store has them as in `axes`.

    `shift` is that of each level in samples of the one before it, as the metadata tell it; None leaves all out.
    """
    kind = 2 if version == "0.4" else 3
    root = zarr.open_group(path, mode="a", zarr_format=kind)
    root = root.require_group(group) if group else root
    have = "".join(each for each in "tczyx" if each in axes)
    order = [have.index(each) for each in axes]
    scale, start, datasets = np.array(SPACING[::-1]), np.array(ORIGIN[::-1]), []
    for level in range(levels):
        turned = values.transpose(order)
        chunks = tuple(min(chunk, n) if a in "zyx" else 1 for a, n in zip(axes, turned.shape, strict=True))
        shards = None if shard is None else tuple(shard if a in "zyx" else 1 for a in axes)
        made = root.create_array(
            str(level), shape=turned.shape, chunks=chunks, shards=shards, dtype=turned.dtype, **array,
            **({"chunk_key_encoding": {"name": "v2", "separator": "/"}} if kind == 2 else {}),
        )  # fmt: skip
        made[...] = turned
        by_name = dict(zip("zyx", scale, strict=True)) | {"t": 2.5, "c": 1.0}
        at = dict(zip("zyx", start, strict=True)) | {"t": 10.0, "c": 0.0}
        told = None if shift is None else [at[each] for each in axes]
        datasets.append(
            {"path": str(level), "coordinateTransformations": transformations([by_name[a] for a in axes], told)}
        )
        start = start + (0.0 if shift is None else shift) * scale
        scale, values = scale * 2, down(values)
    types = {"t": "time", "c": "channel"}
    units = {"z": "micrometer", "y": "micrometer", "x": "micrometer", "t": "second"}
    named = [
        {"name": each, "type": types.get(each, "space")} | ({"unit": units[each]} if each in units else {})
        for each in axes
    ]
    attributes: dict[str, Any] = {"multiscales": [{"axes": named, "datasets": datasets, "name": "picture"}]}
    if omero is not None:
        attributes["omero"] = {"channels": omero}
    attributes |= more or {}
    if kind == 2:
        attributes["multiscales"][0]["version"] = "0.4"
    root.attrs.update(attributes if kind == 2 else {"ome": {"version": version} | attributes})
    return path


def write_imaris(path: Path, values: NDArray, *, levels: int = 2, chunk: int = 16) -> Path:
    """Write channels (c, z, y, x) as Imaris does: padded to chunks, with attributes of single letters."""

    def letters(text: object) -> NDArray:
        return np.array([each.encode() for each in str(text)], dtype="S1")

    with h5py.File(path, "w") as file:
        image = file.create_group("DataSetInfo/Image")
        for axis, n in enumerate(values.shape[:0:-1]):
            image.attrs[f"ExtMin{axis}"] = letters(ORIGIN[axis] - SPACING[axis] / 2)
            image.attrs[f"ExtMax{axis}"] = letters(ORIGIN[axis] + SPACING[axis] * (n - 0.5))
        image.attrs["Unit"] = letters("um")
        for channel in range(len(values)):
            about = file.create_group(f"DataSetInfo/Channel {channel}")
            about.attrs["Color"] = letters("1.000 0.000 0.000" if channel else "0.000 1.000 0.000")
            about.attrs["Name"] = letters(f"stain {channel}")
            about.attrs["ColorRange"] = letters("10.000 200.000")
        for level in range(levels):
            for channel, each in enumerate(values):
                group = file.create_group(f"DataSet/ResolutionLevel {level}/TimePoint 0/Channel {channel}")
                for axis, n in zip("ZYX", each.shape, strict=True):
                    group.attrs[f"ImageSize{axis}"] = letters(n)
                padded = np.pad(each, [(0, -n % chunk) for n in each.shape])
                group.create_dataset("Data", data=padded, chunks=(chunk,) * 3, compression="gzip")
            values = halved(values)
    return path


class _Quiet(http.server.SimpleHTTPRequestHandler):
    """Handler that notes what its server is `asked` for, and drops the connection once it is `broken`."""

    def do_GET(self) -> None:
        self.server.asked.append(self.path)  # type: ignore[attr-defined]
        if getattr(self.server, "broken", False):
            self.connection.close()
            return
        super().do_GET()

    do_HEAD = do_GET

    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def served(folder: Path) -> Iterator[tuple[str, http.server.ThreadingHTTPServer]]:
    """URL of a folder, and its server, which stops when `broken` is set."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=os.fspath(folder)))
    server.asked = []  # type: ignore[attr-defined]
    thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}", server
    finally:
        server.shutdown()
        server.server_close()
        thread.join(10)


def damage(path: Path) -> None:
    """Make a chunk's file unreadable: half of it, with other bytes."""
    content = path.read_bytes()
    path.write_bytes(bytes(255 - each for each in content[: len(content) // 2]))
