"""Compilation of the methods' loops by numba, cached on disk; without numba the error names the extra to install."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from texvol.util.errors import missing_extra

try:
    from numba import njit
except ImportError as error:
    raise missing_extra("numba", "methods", "a method of the survey") from error


def compiled(function: Callable[..., Any]) -> Any:
    """Compile `function` for calls from Python, without the interpreter's lock, so that rows are drawn in threads.

    numba finds cached code by the function's name, and watches its file only. The name gets a hash of `compositing`,
    whose functions are compiled into it.
    """
    function.__qualname__ += f"_{_of_compositing()}"
    try:
        return njit(nogil=True, error_model="numpy", cache=True)(function)
    except RuntimeError:  # neither this package's folder nor the user's cache folder is writable
        return njit(nogil=True, error_model="numpy")(function)


def part(function: Callable[..., Any]) -> Any:
    """Compile `function` for calls from compiled functions."""
    return njit(nogil=True, error_model="numpy")(function)


@cache
def _of_compositing() -> str:
    return hashlib.sha256(Path(__file__).with_name("compositing.py").read_bytes()).hexdigest()[:16]
