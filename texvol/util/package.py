"""Folder of the package, and the environment of a child process that imports it."""

from __future__ import annotations

import os
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]


def environment_of_child(**more: str) -> dict[str, str]:
    """Return the environment of a child process that imports this package, with more variables in it."""
    paths = [str(PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), **more}
