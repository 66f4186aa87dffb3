"""Functions compiled by numba; the only module that imports it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from texvol.errors import missing_extra

try:
    from numba import njit
except ImportError as error:
    raise missing_extra("numba", "oracle", "texvol raycast") from error


def compiled(function: Callable[..., Any]) -> Any:
    """`function` compiled when something compiled calls it; as numpy does, 1 / 0 is infinite."""
    return njit(nogil=True, error_model="numpy")(function)


def compiled_and_kept(function: Callable[..., Any]) -> Any:
    """The same, callable from Python, and kept on disk where some folder for that can be written."""
    try:
        return njit(nogil=True, error_model="numpy", cache=True)(function)
    except RuntimeError:  # neither this package's folder nor the user's own can be written
        return compiled(function)


def sources() -> str:
    """A name for the present text of this package: what is kept on disk under another name is out of date."""
    texts = (path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
    return hashlib.sha256(b"".join(texts)).hexdigest()
