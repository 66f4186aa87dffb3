"""Measurements of `benchmark_large.py` that need a process of their own; each prints one line of JSON.

    python scripts/large_children.py read STORE ONSET | auto STORE FUNCTION | first STORE FUNCTION

What is imported is imported before the clock starts.
"""

from __future__ import annotations

import json
import sys
import time
from collections import deque
from typing import Any

import numpy as np

_IN_FLIGHT = 64  # chunks that TensorStore reads at the same time
_INDEX_CACHE = 256 << 20  # bytes: the indices of shards, which would be read again for every chunk


class Clock:
    """Wall and processor seconds since it was made."""

    def __init__(self) -> None:
        self._wall, self._processor = time.perf_counter(), time.process_time()

    @property
    def seconds(self) -> dict[str, Any]:
        """Both, by name."""
        return {
            "seconds": time.perf_counter() - self._wall,
            "processor_seconds": time.process_time() - self._processor,
        }


def read(store: str, onset: str) -> dict[str, Any]:
    """Read and decode, by TensorStore alone, the chunks of level 0 that hold or touch a value above `onset`."""
    import tensorstore

    chunks = _chunks_above(store, float(onset))
    start = Clock()
    context = tensorstore.Context({"cache_pool": {"total_bytes_limit": _INDEX_CACHE}})
    spec = {"driver": "zarr3", "kvstore": {"driver": "file", "path": f"{store}/0/"}}
    array = tensorstore.open(spec, context=context, read=True, open=True).result()
    length = array.chunk_layout.read_chunk.shape
    waiting: deque[Any] = deque()
    for position in chunks:
        box = tuple(slice(i * c, min(i * c + c, n)) for i, c, n in zip(position, length, array.shape, strict=True))
        waiting.append(array[box].read())
        if len(waiting) >= _IN_FLIGHT:
            waiting.popleft().result()
    while waiting:
        waiting.popleft().result()
    return start.seconds | {"chunks": len(chunks)}


def auto(store: str, function: str) -> dict[str, Any]:
    """Load a store and draw it at the level that pixels show."""
    import moderngl  # noqa: F401
    import tensorstore  # noqa: F401

    import texvol
    from texvol.rendering.renderer import Renderer

    start = Clock()
    scene = texvol.Scene(texvol.load(store), texvol.TransferFunction.load(function))
    with Renderer() as renderer:
        renderer.render(scene, (512, 512))
        return start.seconds


def first(store: str, function: str) -> dict[str, Any]:
    """Load a store and draw the first of the pictures from coarse to fine."""
    import moderngl  # noqa: F401
    import tensorstore  # noqa: F401

    import texvol
    from texvol.rendering.renderer import Renderer
    from texvol.rendering.streaming.progressive import render_progressively

    start = Clock()
    scene = texvol.Scene(texvol.load(store), texvol.TransferFunction.load(function))
    with Renderer() as renderer:
        stage = next(iter(render_progressively(renderer, scene, (512, 512), level=0)))
        return start.seconds | {"level": stage.level}


def _chunks_above(store: str, onset: float) -> list[tuple[int, ...]]:
    """Return the positions of the chunks of level 0 in which something shows, by the store's statistics."""
    import texvol
    from texvol.scene.large_volume import LargeVolume

    volume = texvol.load(store)
    assert isinstance(volume, LargeVolume) and volume.levels[0].statistics is not None
    return [tuple(map(int, each)) for each in np.argwhere(volume.levels[0].statistics.highest_around > onset)]


def main() -> None:
    """Print the measurement that is asked for."""
    name, *words = sys.argv[1:]
    found = {"read": read, "auto": auto, "first": first}[name](*words)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
