"""The benchmark's own checks, which stand beside it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]


def test_the_benchmark_measures_what_it_says() -> None:
    line = [sys.executable, "-m", "pytest", "-q", "-p", "no:xdist", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*line, "scripts/benchmark_checks.py"], cwd=REPOSITORY, capture_output=True, text=True, timeout=550, check=False
    )
    assert done.returncode == 0, done.stdout
