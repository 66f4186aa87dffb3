"""How long pytest takes to compare many pictures and report them: a project in a temporary folder, timed.

    python scripts/benchmark_pictures.py [--pictures 200] [--size 512] [--processes 0,2]

Of ten pictures one is different (shifted by a pixel), four differ within the limits, and five not at all.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TESTS = """
import numpy as np
import pytest

def picture(number):
    # Smooth, with edges and a little of what compresses badly: neither the best nor the worst case for EXR and PNG.
    random = np.random.default_rng(number)
    y, x = np.mgrid[:{size}, :{size}] / {size}
    light = 0.5 + 0.4 * np.sin(9 * x + number) * np.cos(7 * y) + 0.1 * (np.hypot(x - 0.5, y - 0.5) < 0.3)
    light = light + 1e-3 * random.standard_normal(light.shape)
    return np.dstack([light, light**2, 1 - light, np.ones_like(light)]).clip(0, 1).astype(np.float32)

@pytest.mark.parametrize("number", range({pictures}))
def test_picture(check_picture, number):
    made = picture(number)
    if not {first} and number % 10 == 0:
        made = np.roll(made, 1, axis=1)
    elif not {first} and number % 10 < 5:
        made = made + np.float32(1e-5)
    check_picture(made, f"p{{number}}")
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pictures", type=int, default=200)
    parser.add_argument("--size", type=int, default=512, help="pixels of each side")
    parser.add_argument("--processes", default="0,2", help="of pytest-xdist, one run each; 0: without")
    arguments = parser.parse_args()
    names = {name: text for name, text in os.environ.items() if name != "CI"}
    with tempfile.TemporaryDirectory() as folder:

        def run(first: bool, *more: str) -> tuple[float, str]:
            text = TESTS.format(size=arguments.size, pictures=arguments.pictures, first=first)
            Path(folder, "test_pictures.py").write_text(text, encoding="utf-8")
            start = time.perf_counter()
            command = [sys.executable, "-m", "pytest", "-q", "--tb=no", "-rN", *more]
            done = subprocess.run(command, cwd=folder, env=names, capture_output=True, text=True, check=False)
            return time.perf_counter() - start, done.stdout.strip().splitlines()[-1]

        print(f"{'written':12}{run(True, '--texvol-update')[0]:6.1f} s")
        for processes in arguments.processes.split(","):
            seconds, last = run(False, "-n", processes, "--texvol-report", "report")
            size = sum(path.stat().st_size for path in Path(folder, "report").rglob("*") if path.is_file())
            name = f"-n {processes}"
            print(f"{name:12}{seconds:6.1f} s, report {size / 1e6:.0f} MB; {last}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
