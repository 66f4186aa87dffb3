"""Functions that run on a worker: each process keeps one context, with the textures of the scene that it drew last."""

from __future__ import annotations

import os
import threading
import time
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.distributed.cropped import Cropped, cropped
from texvol.distributed.sending import Unpacker
from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import open_context
from texvol.opengl.texture_store import Stopwatch, default_budget
from texvol.rendering.any_pictures import AnyPictures
from texvol.rendering.settings import Settings
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene


@dataclass(frozen=True)
class Machine:
    """Back end of a worker, and bytes of its textures and samples; None: as much as is good."""

    backend: str = "auto"
    texture_memory: int | None = None
    memory: int | None = None
    threads: int | None = None  # of a software driver


@dataclass(frozen=True)
class Order:
    """Picture of a block that is wanted."""

    scene: bytes
    size: tuple[int, int]
    settings: Settings
    block: NDArray[np.float64] | None
    depth: bool = False
    count: bool = False
    repeat: int = 1


@dataclass(frozen=True)
class Drawn:
    """Picture of a block, and what is told of it."""

    picture: Cropped | NDArray[np.float32] | int
    rounding: float
    lost_digits: float
    stats: dict[str, Any]


class _Worker:
    """Context of this process, its pictures, and the scenes that were sent."""

    def __init__(self, machine: Machine) -> None:
        if machine.threads is not None:
            os.environ.setdefault("LP_NUM_THREADS", str(machine.threads))  # of llvmpipe, which would take all cores
        self.lock, self.unpacker, self.watch = threading.Lock(), Unpacker(), Stopwatch()
        self.context = open_context(machine.backend)
        with self.context:
            self.compositor = Compositor(self.context)
            budget = machine.texture_memory or default_budget(self.context)
            self.pictures = AnyPictures(self.context, self.compositor, budget, self.watch)


@cache
def _worker(machine: Machine) -> _Worker:
    return _Worker(machine)


_MAKING = threading.Lock()


def draw(machine: Machine, order: Order, parts: dict[str, bytes]) -> Drawn:
    """Draw a block: its picture, cropped, or the depth of its isosurface, or its number of sampled slabs."""
    start, cpu = time.perf_counter(), time.process_time()
    with _MAKING:
        worker = _worker(machine)
    with worker.lock, worker.context:
        scene = with_memory(worker.unpacker.unpack(order.scene, parts), machine.memory)
        pictures = worker.pictures.of(scene)
        settings, size = order.settings, order.size
        worker.watch.seconds.clear()
        found: Cropped | NDArray[np.float32] | int
        if order.count:
            found = pictures.count(scene, size, settings, order.block)
        else:
            picture = pictures.draw(scene, size, settings, order.repeat, order.depth, order.block)
            found = picture if order.block is None else cropped(picture)
        stats = {
            "seconds": time.perf_counter() - start,
            "cpu_seconds": time.process_time() - cpu,
            "steps": dict(worker.watch.seconds),
            "bricks_drawn": pictures.bricks_drawn,
            "process": os.getpid(),
            "renderer": worker.context.renderer,
        }
        if isinstance(scene.volume, LargeVolume):
            stats["parts"] = worker.pictures.in_parts.stats
        return Drawn(found, pictures.rounding(scene), pictures.lost_digits, stats)


def raycast_pixels(
    machine: Machine, scene: bytes, size: tuple[int, int], pixels: NDArray[np.intp], parts: dict[str, bytes]
) -> NDArray[np.float64]:
    """Return some pixels of the oracle's picture, shape (n, 4)."""
    from texvol.rendering.streaming import exact

    return exact.raycast_pixels(with_memory(_unpacker().unpack(scene, parts), machine.memory), size, pixels)


@cache
def _unpacker() -> Unpacker:
    return Unpacker()


def with_memory(scene: CompleteScene, memory: int | None) -> CompleteScene:
    """Return the scene whose large volumes hold at most so many bytes of samples."""
    if memory is not None and isinstance(scene.volume, LargeVolume):
        scene.volume.memory = min(scene.volume.memory, memory)
    return scene


def without_picture(drawn: Drawn) -> Drawn:
    """Return what is told of a block."""
    return replace(drawn, picture=0)


def picture_of(drawn: Drawn) -> Cropped:
    """Return the picture of a block."""
    assert isinstance(drawn.picture, Cropped)
    return drawn.picture
