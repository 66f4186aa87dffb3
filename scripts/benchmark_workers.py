"""Seconds of a picture by one worker and by several, with an empty and with a filled memory; prints Markdown.

    python scripts/benchmark_workers.py VOLUME [--workers 1,2] [--rounds 5] [--json FILE]

Processor seconds stand beside wall seconds: where workers share the cores with others only they compare. Their speed-up
is that of the processor seconds of one worker against those of the busiest of several. With --json it writes the
wall seconds for `scale_model.py --held-against`.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from pathlib import Path

from benchmark_timing import columns, machine, row

import texvol
from texvol import DistributedRenderer, Scene, Workers

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
    arguments = parser.parse_args()
    print(machine() + "\n")
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
