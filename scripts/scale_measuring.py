"""Throughput of this machine for `scale_model.py`, measured on a store."""

from __future__ import annotations

import socket
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

from texvol import Renderer, Scene, load
from texvol.distributed.cropped import Cropped, over
from texvol.scene.large_volume import LargeVolume

_READ = 1 << 30  # stored bytes, at most, that are read
_SAMPLES = 1 << 27  # of a level that is decoded and drawn, at most
_SIDE = 1024  # pixels of pictures that are composited and sent
_SIZE = (512, 512)
_TIMES = 8


def measured(store: Path) -> dict[str, float]:
    """Return the rates of `scale_model.Throughput` that can be measured here: one worker that uses all cores.

    Files are read as the system has them: those that it keeps in memory are read from there. Messages go over the
    loopback.
    """
    volume = load(store)
    assert isinstance(volume, LargeVolume)
    sizes = [np.prod(level.source.shape, dtype=float) for level in volume.levels]
    level = next((n for n, size in enumerate(sizes) if size <= _SAMPLES), len(sizes) - 1)
    latency, network = _network()
    rates = {"read": _read(store), "composite": _composite(), "network": network, "latency": latency}
    return rates | {"decode": _decode(volume, level), "draw": _draw(volume, level)}


def _read(store: Path) -> float:
    start, total = time.perf_counter(), 0
    for path in sorted(store.rglob("*")):
        if path.is_file() and total < _READ:
            total += len(path.read_bytes())
    return total / 1e6 / (time.perf_counter() - start)


def _decode(volume: LargeVolume, level: int) -> float:
    source = volume.levels[level].source
    whole = slice(0, source.shape[0]), slice(0, source.shape[1]), slice(0, source.shape[2])
    source.read(whole)  # from now on the system has the files in memory
    start = time.perf_counter()
    values = source.read(whole)
    return values.nbytes / 1e6 / (time.perf_counter() - start)


def _draw(volume: LargeVolume, level: int) -> float:
    """Return million samples of the regions drawn that are baked, uploaded and drawn in a second."""
    scene = Scene(volume.at_level(level), "grey", classification="post")
    with Renderer() as renderer:
        renderer.render(Scene(volume.overview, "grey", classification="post"), _SIZE)  # compiles
        renderer.render(scene, _SIZE, level=0)
        seconds = renderer.seconds
        parts: dict[str, Any] = renderer.stats["parts"]
    waited = min(float(parts["seconds_waited"]), seconds["draw"])
    samples = scene.volume.values.size * parts["regions_drawn"] / parts["regions"]
    return samples / 1e6 / (seconds["bake"] + seconds["upload"] + seconds["draw"] - waited)


def _composite() -> float:
    random = np.random.default_rng(1)
    pictures = [Cropped(random.random((_SIDE, _SIDE, 4), np.float32)) for _ in range(2)]
    over(*pictures)
    start = time.perf_counter()
    for _ in range(_TIMES):
        over(*pictures)
    return _TIMES * _SIDE**2 / 1e6 / (time.perf_counter() - start)


def _network() -> tuple[float, float]:
    """Return seconds of a message of a byte, and MB/s of one as large as a picture."""
    near, far = socket.socketpair()
    with near, far:
        count = 16 * _SIDE**2
        latency = min(_sent(near, far, 1) for _ in range(_TIMES))
        return latency, count / 1e6 / min(_sent(near, far, count) for _ in range(_TIMES))


def _sent(near: socket.socket, far: socket.socket, count: int) -> float:
    start = time.perf_counter()
    sender = threading.Thread(target=near.sendall, args=(bytes(count),))
    sender.start()
    while count > 0:
        count -= len(far.recv(min(count, 1 << 20)))
    sender.join()
    return time.perf_counter() - start
