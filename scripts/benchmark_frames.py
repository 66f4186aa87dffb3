"""Seconds of the frames of an orbit in one process and by workers, which draw them whole; prints Markdown.

    python scripts/benchmark_frames.py VOLUME [--frames 24] [--workers 1,2]

Workers are there before the clock begins. Processor seconds stand beside wall seconds: where workers share the cores
with others only they compare. Their speed-up is that of the one process against those of the busiest worker.
"""

from __future__ import annotations

import argparse
import time
from contextlib import ExitStack
from dataclasses import replace

from benchmark_timing import columns, machine, row

import texvol
from texvol import DistributedRenderer, Renderer, Scene, Workers
from texvol.scene import orbit

_SIZE = (512, 512)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])  # type: ignore[union-attr]
    parser.add_argument("volume")
    parser.add_argument("--workers", default="1,2", help="numbers of workers (1,2)")
    parser.add_argument("--frames", type=int, default=24, help="once around (24)")
    parser.add_argument("--tf", default="fog")
    parser.add_argument("--rate", type=float, default=1.0, help="slabs per sample (1)")
    arguments = parser.parse_args()
    print(machine() + "\n")
    columns("workers", "wall s", "frames per s", "all, processor s", "busiest, processor s", "speed-up by processor s")
    alone = None
    for count in [None, *map(int, arguments.workers.split(","))]:
        wall, spent = seconds_of_frames(arguments, count)
        alone = alone or sum(spent)
        busiest = max(spent)
        numbers = f"{wall:.2f}", f"{arguments.frames / wall:.2f}", f"{sum(spent):.2f}", f"{busiest:.2f}"
        row("one process" if count is None else count, *numbers, f"{alone / busiest:.2f}")


def seconds_of_frames(arguments: argparse.Namespace, count: int | None) -> tuple[float, list[float]]:
    """Return the wall seconds of an orbit, and the processor seconds of each process that drew; None: this one."""
    scene = Scene(texvol.load(arguments.volume), arguments.tf, classification="post")
    camera = scene.completed(_SIZE).camera
    turned = (replace(scene, camera=orbit.turned(camera, 360 * i / arguments.frames)) for i in range(arguments.frames))
    with ExitStack() as opened:
        workers = None if count is None else opened.enter_context(Workers(count))
        renderer = opened.enter_context(Renderer() if workers is None else DistributedRenderer(workers))
        start, cpu = time.perf_counter(), time.process_time()
        asked = {"count": arguments.frames, "views": arguments.frames, "sampling_rate": arguments.rate}
        for _ in renderer.frames(turned, _SIZE, **asked, max_error=None):
            pass
        wall = time.perf_counter() - start
        if workers is None:
            return wall, [time.process_time() - cpu]
        spent: dict[int, float] = {}
        for frame in renderer.stats["frames"]:
            spent[frame["process"]] = spent.get(frame["process"], 0.0) + frame["cpu_seconds"]
        return wall, list(spent.values())


if __name__ == "__main__":
    main()
