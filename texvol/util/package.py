"""The package as files: its folder, and an environment in which a child process imports the same texvol."""

from __future__ import annotations

import os
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]


def environment_of_child(**more: str) -> dict[str, str]:
    """Return the environment of a child process that has to import this package, with further variables in it."""
    paths = [str(PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), **more}
