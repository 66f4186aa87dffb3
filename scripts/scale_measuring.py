"""Throughput of this machine for `scale_model.py`, measured on a store, and parameters of a picture for it."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol import DistributedRenderer, Renderer, Scene, Workers, load
from texvol.distributed.cropped import Cropped, over
from texvol.rendering.streaming.visibility import chunks_that_show
from texvol.scene.large_volume import LargeVolume

SIZE = (512, 512)
_READ = 1 << 30  # stored bytes, at most, that are read
_SAMPLES = 1 << 27  # of a level that is decoded and drawn, at most
_SIDE = 1024  # pixels of pictures that are composited and sent
_TINY = (8, 8)
_TIMES, _TASKS, _STARTS = 8, 256, 3
_LEAST = 0.1  # of a first picture: what preparing takes is a difference, which noise can make too small


def scene_of(store: Path | str, function: str, level: int = 0) -> Scene:
    """Return the scene of a level of a store."""
    volume = load(store)
    if not isinstance(volume, LargeVolume):
        raise SystemExit(f"{store}: must be a store of chunks, such as OME-Zarr")
    return Scene(volume.at_level(level) if level else volume, function, classification="post")


def picture_of(scene: Scene, picture: NDArray[np.float32], rate: float, parts: dict[str, Any]) -> dict[str, float]:
    """Return what `scale_model.Picture` has of a picture, in JSON types; `parts` are what its stats say of chunks."""
    volume = scene.volume
    assert isinstance(volume, LargeVolume) and volume.levels[0].statistics is not None
    shows = chunks_that_show(scene.completed(SIZE), volume)
    assert shows is not None
    chunk = volume.levels[0].statistics.chunk_shape
    decoded = parts["chunks_decoded"] * float(np.prod(chunk, dtype=float)) * volume.dtype.itemsize
    return {
        "size": float(np.prod(volume.dimensions, dtype=float)) * volume.dtype.itemsize,
        "sample_bytes": volume.dtype.itemsize,
        "compression": parts["bytes_read"] / max(decoded, 1.0),
        "visible": float(shows.mean()),
        "pixels": int((picture[..., 3] > 0).sum()),
        "chunk": float(np.prod(chunk, dtype=float) ** (1 / 3)),
        "rate": rate,
        "shared": os.cpu_count() or 1,
    }


def blocks_of(renderer: DistributedRenderer) -> list[dict[str, Any]]:
    """Return what `--stats` tells of each block of the last picture; nothing is drawn for it."""
    assert renderer._last is not None
    found: list[dict[str, Any]] = renderer._distributed.described(*renderer._last)["blocks"]
    return found


def measured(store: Path, function: str = "fog") -> dict[str, float]:
    """Return the rates of `scale_model.Throughput` that can be measured here.

    Files are read as the system has them: those that it keeps in memory are read from there. Messages go over the
    loopback, as workers send them. Rates of the processor are of its own seconds, so that other work that shares it
    changes them little; how many cores are kept busy is wrong beside other work.
    """
    volume = scene_of(store, function).volume
    assert isinstance(volume, LargeVolume)
    sizes = [np.prod(level.source.shape, dtype=float) for level in volume.levels]
    level = next((n for n, size in enumerate(sizes) if size <= _SAMPLES), len(sizes) - 1)
    rates = {"read": _read(store), "composite": _composite()}
    return rates | _drawn(scene_of(store, function, level)) | _distributed(store, function)


def _read(store: Path) -> float:
    start, total = time.perf_counter(), 0
    for path in sorted(store.rglob("*")):
        if path.is_file() and total < _READ:
            total += len(path.read_bytes())
    return total / 1e6 / (time.perf_counter() - start)


def _times(action: Callable[[], object]) -> tuple[float, float]:
    """Return wall seconds and processor seconds of a call."""
    start, processor = time.perf_counter(), time.process_time()
    action()
    return time.perf_counter() - start, time.process_time() - processor


def _drawn(scene: Scene) -> dict[str, float]:
    """Return the rates of decoding, preparing and drawing, by a first picture and later ones that only draw.

    What a first picture takes beyond a later one are decoding and preparing.
    """
    volume = scene.volume
    assert isinstance(volume, LargeVolume)
    pictures: list[NDArray[np.float32]] = []
    firsts, later = [], []

    def draw() -> None:
        pictures.append(renderer.render(scene, SIZE, level=0, sampling_rate=1.0))

    for _ in range(_STARTS):
        with Renderer() as renderer:
            renderer.render(Scene(volume.overview, scene.transfer_function, classification="post"), SIZE)  # compiles
            firsts.append(_times(draw))
            parts = renderer.stats["parts"]
            later += [_times(draw) for _ in range(_TIMES)]
    (first_wall, first), (wall, processor) = (medians(each) for each in (firsts, later))
    told = picture_of(scene, pictures[0], 1.0, parts)
    samples = told["visible"] * told["size"] / told["sample_bytes"] / 1e6
    rays = told["visible"] * told["pixels"] * (told["size"] / told["sample_bytes"]) ** (1 / 3) / 1e6
    decode = _decode(volume)
    decoding = told["visible"] * told["size"] / 1e6 / decode
    return {
        "decode": decode,
        "prepare": samples / max(first - processor - decoding, _LEAST * first),
        "draw": rays / processor,
        "cores": (first - processor) / max(first_wall - wall, _LEAST * first_wall),
        "draw_cores": processor / wall,
    }


def medians(found: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the medians of wall seconds and of processor seconds."""
    walls, processors = zip(*found, strict=True)
    return statistics.median(walls), statistics.median(processors)


def _decode(volume: LargeVolume) -> float:
    """Return decoded megabytes by a second of the processor."""
    source = volume.levels[0].source
    whole = slice(0, source.shape[0]), slice(0, source.shape[1]), slice(0, source.shape[2])
    values = source.read(whole)  # from now on the system has the files in memory
    processor = statistics.median(_times(lambda: source.read(whole))[1] for _ in range(_STARTS))
    return values.nbytes / 1e6 / processor


def _composite() -> float:
    random = np.random.default_rng(1)
    pictures = [Cropped(random.random((_SIDE, _SIDE, 4), np.float32)) for _ in range(2)]
    over(*pictures)
    seconds = min(_times(lambda: over(*pictures))[0] for _ in range(_TIMES))
    return _SIDE**2 / 1e6 / seconds


def _distributed(store: Path, function: str) -> dict[str, float]:
    """Return what a picture takes beside its samples: of client, scheduler, messages, and a process that begins."""
    scene = scene_of(store, function)
    assert isinstance(scene.volume, LargeVolume)
    coarsest = len(scene.volume.levels) - 1
    walls, busy = [], []
    with Workers(1) as workers, DistributedRenderer(workers) as renderer:
        for _ in range(_TIMES + 1):
            walls.append(_times(lambda: renderer.render(scene, _TINY, level=coarsest))[0])
            busy.append(blocks_of(renderer)[0]["cpu_seconds"])
        client, picture = workers._client, statistics.median(walls[1:])
        client.gather(client.map(abs, range(_TASKS), pure=False))
        task = min(_times(lambda: client.gather(client.map(abs, range(_TASKS), pure=False)))[0] for _ in range(2))
        latency, sending = _messages(client)
    return {
        "task": task / _TASKS,
        "picture": max(picture - 3 * task / _TASKS - latency, 0.0),
        "start": walls[0] - picture,
        "start_processor": busy[0] - statistics.median(busy[1:]),
        "latency": latency,
        "network": sending,
    }


def _messages(client: Any) -> tuple[float, float]:
    """Return seconds of a message, and MB/s of one as large as a picture."""
    little, much = (client.submit(np.zeros, (side, side, 4), np.float32, pure=False) for side in (1, _SIDE))
    client.gather([little, much])
    latency = min(_times(lambda: client.gather(little))[0] for _ in range(_TIMES))
    seconds = min(_times(lambda: client.gather(much))[0] for _ in range(_TIMES))
    return latency, 16 * _SIDE**2 / 1e6 / max(seconds - latency, 1e-6)
