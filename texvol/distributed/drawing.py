"""Functions that run on a worker: each process keeps one context, with the textures of the scene that it drew last."""

from __future__ import annotations

import os
import threading
import time
import warnings
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from texvol.distributed.cropped import Cropped, cropped
from texvol.distributed.sending import Unpacker
from texvol.rendering.checking import Check
from texvol.rendering.classification import Classified
from texvol.rendering.error_control import ByTiles
from texvol.rendering.frames import Kept, frame_of
from texvol.rendering.renderer import Renderer
from texvol.rendering.settings import Settings
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene, Scene

SceneOfAnyKind = TypeVar("SceneOfAnyKind", bound=Scene)
# Workers among whom memory may be divided while each has room for eight of the regions that the whole has 32 of: for
# two of them as textures, a quarter of it, and for those that are read ahead.
_MOST_SHARED = 4
_Moment = tuple[float, float]  # seconds of the wall and of the processor


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


@dataclass(frozen=True)
class FrameOrder:
    """Whole frame of a sequence that is wanted; the first one if nothing is `kept` from another."""

    size: tuple[int, int]
    views: int
    accuracy: dict[str, Any]
    kept: Kept | None = None
    report: bool = False  # True if the report of `--stats` is wanted as well


@dataclass(frozen=True)
class DrawnFrame:
    """Picture of a frame, and what is told of it."""

    picture: Cropped
    kept: Kept
    settings: Settings
    by_tiles: ByTiles
    chosen: Classified | None
    check: Check | None
    warnings: tuple[tuple[type[Warning], str], ...]
    needed: int  # bytes of the textures, or of the samples of a large volume, that the frame takes
    room: int  # bytes that this worker has for them
    stats: dict[str, Any]
    report: dict[str, Any] | None


class _Worker(Renderer):
    """Renderer of this process, and the scenes that were sent."""

    def __init__(self, machine: Machine) -> None:
        if machine.threads is not None:
            os.environ.setdefault("LP_NUM_THREADS", str(machine.threads))  # of llvmpipe, which would take all cores
        textures = machine.texture_memory
        super().__init__(machine.backend, texture_memory=textures / 1e6 if textures else None)
        self._machine, self.lock, self._unpacker = machine, threading.Lock(), Unpacker()

    def block(self, order: Order, parts: dict[str, bytes], began: _Moment) -> Drawn:
        """Draw a block, or count its samples."""
        with self._context:
            scene = self._scene(order.scene, parts)
            assert isinstance(scene, CompleteScene)
            pictures, settings, size = self._pictures_of(scene), order.settings, order.size
            self._watch.seconds.clear()
            found: Cropped | NDArray[np.float32] | int
            if order.count:
                found = pictures.count(scene, size, settings, order.block)
            else:
                picture = pictures.draw(scene, size, settings, order.repeat, order.depth, order.block)
                found = picture if order.block is None else cropped(picture)
            return Drawn(found, pictures.rounding(scene), pictures.lost_digits, self._told(scene, began))

    def frame(self, order: FrameOrder, content: bytes, parts: dict[str, bytes], began: _Moment) -> DrawnFrame:
        """Draw a whole frame."""
        scene = self._scene(content, parts)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            frame = frame_of(self, scene, order.size, order.views, order.accuracy, order.kept)
        told = self._told(scene, began)
        needed, room = self._needed_and_room(scene)
        assert self._last is not None
        return DrawnFrame(
            cropped(frame.picture),
            frame.kept,
            self._last[2],
            self._by_tiles,
            self.chosen,
            self.check,
            tuple((each.category, str(each.message)) for each in said),
            needed,
            room,
            told,
            self.stats | {"seconds": told["steps"]} if order.report else None,
        )

    def prepare(self, content: bytes, parts: dict[str, bytes]) -> None:
        """Unpack a scene that will be drawn."""
        self._scene(content, parts)

    def _scene(self, content: bytes, parts: dict[str, bytes]) -> Scene:
        """Return a scene that was sent; its large volume holds no more samples than this worker may."""
        return with_memory(self._unpacker.unpack(content, parts), self._machine.memory)

    def _told(self, scene: Scene, began: _Moment) -> dict[str, Any]:
        """Return what is told of the last picture."""
        now = _now()
        told = {
            "seconds": now[0] - began[0],
            "cpu_seconds": now[1] - began[1],
            "steps": self.seconds,
            "bricks_drawn": self._pictures_of(scene).bricks_drawn,
            "process": os.getpid(),
            "renderer": self.renderer_name,
        }
        return told | ({"parts": self._pictures.streamed(scene).stats} if isinstance(scene.volume, LargeVolume) else {})

    def _needed_and_room(self, scene: Scene) -> tuple[int, int]:
        """Return the bytes that the last frame took, and those that there is room for."""
        if isinstance(scene.volume, LargeVolume):
            parts = self._pictures.streamed(scene).stats
            return parts["bytes_wanted"], parts["memory"]
        return sum(each.textures.bytes_of_all for each in self._pictures.in_memory.cache.volumes), self._budget


def _now() -> _Moment:
    return time.perf_counter(), time.process_time()


@cache
def _worker(machine: Machine) -> _Worker:
    return _Worker(machine)


_MAKING = threading.Lock()  # of what there is one of in a process


def draw(machine: Machine, order: Order, parts: dict[str, bytes]) -> Drawn:
    """Draw a block: its picture, cropped, or the depth of its isosurface, or its number of sampled slabs."""
    began = _now()
    with _MAKING:
        worker = _worker(machine)
    with worker.lock, np.errstate(all="ignore"):
        return worker.block(order, parts, began)


def draw_frame(machine: Machine, order: FrameOrder, scene: bytes, parts: dict[str, bytes]) -> DrawnFrame:
    """Draw a whole frame of a sequence, as a renderer of one process draws it."""
    began = _now()
    with _MAKING:
        worker = _worker(machine)
    with worker.lock, np.errstate(all="ignore"):
        return worker.frame(order, scene, parts, began)


def prepare(machine: Machine, scene: bytes, parts: dict[str, bytes]) -> None:
    """Open the context of this process, and unpack a scene that it will draw."""
    with _MAKING:
        worker = _worker(machine)
    with worker.lock:
        worker.prepare(scene, parts)


def raycast_pixels(
    machine: Machine, scene: bytes, size: tuple[int, int], pixels: NDArray[np.intp], parts: dict[str, bytes]
) -> NDArray[np.float64]:
    """Return some pixels of the oracle's picture, shape (n, 4)."""
    from texvol.rendering.streaming import exact

    with _MAKING:
        unpacked = with_memory(_unpacker().unpack(scene, parts), machine.memory)
    return exact.raycast_pixels(unpacked, size, pixels)


@cache
def _unpacker() -> Unpacker:
    return Unpacker()


def with_memory(scene: SceneOfAnyKind, memory: int | None) -> SceneOfAnyKind:
    """Return the scene whose large volumes hold at most so many bytes of samples.

    They are cut into the same regions as in one process, as far as there is room for them: texels of other regions
    would be rounded in another way.
    """
    for volume in scene.volumes:
        if memory is None or not isinstance(volume, LargeVolume):
            continue
        if volume.cut_for is None:
            volume.cut_for = min(volume.memory, _MOST_SHARED * memory)
        volume.memory = min(volume.memory, memory)
    return scene


def without_picture(drawn: Drawn) -> Drawn:
    """Return what is told of a block."""
    return replace(drawn, picture=0)


def picture_of(drawn: Drawn) -> Cropped:
    """Return the picture of a block."""
    assert isinstance(drawn.picture, Cropped)
    return drawn.picture
