"""Time `texvol render` as a whole command, cold: a 128³ NPY to a 512×512 PNG; median and peak memory, in Markdown.

    python scripts/benchmark.py [--runs N] [--samples N]

Every run is a new process, as a script would start it; the driver's own cache of compiled shaders is warm after the
first run, which is not counted.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np


def marschner_lobb(samples: int) -> np.ndarray:
    """The test signal of Marschner and Lobb (1994) on `samples`³, values 0 … 1."""
    axis = (np.arange(samples) + 0.5) / samples * 2 - 1
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    rings = np.cos(2 * np.pi * 6 * np.cos(np.pi * np.hypot(x, y) / 2))
    return (1 - np.sin(np.pi * z / 2) + 0.25 * (1 + rings)) / 2.5


def run_once(line: list[str]) -> tuple[float, float]:
    """Wall seconds and peak MiB of one process."""
    start = time.perf_counter()
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    if status:
        raise SystemExit(f"{' '.join(line)} ended with status {status}")
    return seconds, usage.ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=9)
    parser.add_argument("--samples", type=int, default=128)
    arguments = parser.parse_args()
    values = marschner_lobb(arguments.samples)
    volumes = {
        "uint8": (values * 255).astype(np.uint8),
        "uint16": (values * 65535).astype(np.uint16),
        "float32": values.astype(np.float32),
    }
    print(f"{platform.machine()}, {os.cpu_count()} cores; {arguments.samples}³ to 512×512 PNG, whole command\n")
    print("| type | seconds, median (least … most) | peak MiB |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name, samples in volumes.items():
            volume, picture = Path(folder, f"{name}.npy"), Path(folder, "picture.png")
            np.save(volume, samples)
            line = [sys.executable, "-m", "texvol", "render", str(volume), "-o", str(picture)]
            results = [run_once(line) for _ in range(arguments.runs + 1)][1:]
            seconds, memory = zip(*results, strict=True)
            spread = f"{min(seconds):.2f} … {max(seconds):.2f}"
            print(f"| {name} | {statistics.median(seconds):.2f} ({spread}) | {max(memory):.0f} |", flush=True)


if __name__ == "__main__":
    main()
