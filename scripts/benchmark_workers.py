"""Seconds of a picture by one worker and by several, with an empty and with a filled memory; prints Markdown.

    python scripts/benchmark_workers.py STORE [--workers 1,2] [--starts 3] [--rounds 5] [--json FILE]

Processor seconds stand beside wall seconds: where workers share the cores with others only they compare. Their speed-up
is that of the processor seconds of one worker against those of the busiest of several. With --json it writes both
and what was drawn for `scale_model.py --held-against`.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass
from pathlib import Path

from benchmark_timing import columns, machine, row
from scale_measuring import SIZE, blocks_of, medians, picture_of, scene_of

from texvol import DistributedRenderer, Workers


def main() -> int:
    """Measure, print, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])  # type: ignore[union-attr]
    parser.add_argument("store")
    parser.add_argument("--workers", default="1,2", help="numbers of workers (1,2)")
    parser.add_argument("--starts", type=int, default=3, help="how often workers are started (3)")
    parser.add_argument("--rounds", type=int, default=5, help="warm pictures after each start (5); 0: none")
    parser.add_argument("--tf", default="fog")
    parser.add_argument("--rate", type=float, default=1.0, help="slabs per sample (1)")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    print(machine() + "\n")
    columns(
        "workers", "first picture s", "busiest worker, processor s", "speed-up", "warm s", "processor s", "speed-up"
    )
    found: dict[str, Measured] = {}
    for count in map(int, arguments.workers.split(",")):
        found[str(count)] = own = measured(arguments, count)
        one = next(iter(found.values()))
        row(count, *cells(own.first, one.first), *cells(own.again, one.again))
    if arguments.json:
        told = {
            "picture": next(iter(found.values())).picture,
            "first": {count: each.first for count, each in found.items()},
            "again": {count: each.again for count, each in found.items() if each.again},
        }
        arguments.json.write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")
    return 0


@dataclass(frozen=True)
class Measured:
    """Wall seconds and processor seconds of the busiest worker, of the first picture and of a later one."""

    first: tuple[float, float]
    again: tuple[float, float] | None
    picture: dict[str, float]  # as `scale_model.Picture` has it


def cells(own: tuple[float, float] | None, one: tuple[float, float] | None) -> list[str]:
    """Return wall and processor seconds, and how many times less processor seconds those are than of one worker."""
    return [f"{each:.2f}" for each in (*own, one[1] / own[1])] if own and one else ["–"] * 3


def measured(arguments: argparse.Namespace, count: int) -> Measured:
    """Draw by so many workers, several times by processes that have just begun."""
    scene = scene_of(arguments.store, arguments.tf)
    firsts, later, pictures = [], [], []

    def draw() -> tuple[float, float]:
        start = time.perf_counter()
        pictures[:] = [renderer.render(scene, SIZE, level=0, sampling_rate=arguments.rate)]
        return time.perf_counter() - start, max(block["cpu_seconds"] for block in blocks_of(renderer))

    for _ in range(arguments.starts):
        with Workers(count) as workers, DistributedRenderer(workers) as renderer:
            firsts.append(draw())
            parts = blocks_of(renderer)[0]["parts"]
            later += [draw() for _ in range(arguments.rounds)]
    again = medians(later) if later else None
    return Measured(medians(firsts), again, picture_of(scene, pictures[0], arguments.rate, parts))


if __name__ == "__main__":
    raise SystemExit(main())
