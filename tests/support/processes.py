"""Processes of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]


def imported_by(code: str, folder: Path) -> set[str]:
    """Top-level names of all modules that are loaded once the code has run."""
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys\nprint('loaded', *sys.modules)"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(REPOSITORY)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return {name.split(".")[0] for name in done.stdout.splitlines()[-1].split()[1:]}


def open_files() -> set[tuple[str, str]]:
    """Return the numbers of the open files of this process, and what they are.

    The kernel's own tables do not count: threads that watch a cluster of workers open and close them at any time.
    """
    found = set()
    for number in os.listdir("/proc/self/fd"):
        with suppress(OSError):  # that of the list itself
            found.add((number, os.readlink(f"/proc/self/fd/{number}")))
    return {(number, name) for number, name in found if not name.startswith("/proc/")}
