"""Seconds of a picture by one worker and by several, with an empty and with a filled memory; prints Markdown.

    python scripts/benchmark_workers.py VOLUME [--workers 1,2] [--rounds 5] [--json FILE] [--frames N]

Processor seconds stand beside wall seconds: where workers share the cores with others only they compare. Their speed-up
is that of the processor seconds of one worker against those of the busiest of several. With --json it writes the
wall seconds for `scale_model.py --held-against`. With --frames it draws an orbit of so many frames instead, in one
process and by each number of workers, which draw them whole.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from benchmark_timing import columns, machine, row

import texvol
from texvol import DistributedRenderer, Renderer, Scene, Workers
from texvol.scene import orbit

_SIZE = (512, 512)


def main() -> int:
    """Measure, print, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])  # type: ignore[union-attr]
    parser.add_argument("volume")
    parser.add_argument("--workers", default="1,2", help="numbers of workers (1,2)")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--tf", default="fog")
    parser.add_argument("--rate", type=float, default=1.0, help="slabs per sample (1)")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--frames", type=int, help="frames of an orbit, in place of single pictures")
    arguments = parser.parse_args()
    print(machine() + "\n")
    if arguments.frames:
        measure_frames(arguments)
        return 0
    columns("workers", "first picture s", "warm s", "busiest worker, processor s", "speed-up by processor s")
    seconds, alone = {}, None
    for count in map(int, arguments.workers.split(",")):
        first, warm, busiest = measured(arguments, count)
        alone = alone or busiest
        seconds[str(count)] = warm
        row(count, f"{first:.2f}", f"{warm:.3f}", f"{busiest:.3f}", f"{alone / busiest:.2f}")
    if arguments.json:
        arguments.json.write_text(json.dumps({"workers": seconds}, indent=2) + "\n", encoding="utf-8")
    return 0


def measure_frames(arguments: argparse.Namespace) -> None:
    """Print seconds of an orbit in one process and by workers, which are there before the clock begins."""
    columns(
        "workers",
        "wall s",
        "frames per s",
        "all workers, processor s",
        "busiest, processor s",
        "speed-up by processor s",
    )
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


def measured(arguments: argparse.Namespace, count: int) -> tuple[float, float, float]:
    """Return the seconds of the first and of a later picture, and the processor seconds of the busiest worker."""
    scene = Scene(texvol.load(arguments.volume), arguments.tf, classification="post")
    with Workers(count) as workers, DistributedRenderer(workers) as renderer:
        walls, busiest = [], []
        for _ in range(arguments.rounds + 1):
            start = time.perf_counter()
            renderer.render(scene, _SIZE, level=0, sampling_rate=arguments.rate)
            walls.append(time.perf_counter() - start)
            blocks = renderer._distributed.described(*renderer._last)["blocks"]  # type: ignore[misc]
            busiest.append(max(block["cpu_seconds"] for block in blocks))
    return walls[0], statistics.median(walls[1:]), statistics.median(busiest[1:])


if __name__ == "__main__":
    raise SystemExit(main())
