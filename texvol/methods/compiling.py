"""Compilation of the methods' loops by numba, cached on disk; without numba the error names the extra to install."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from texvol.util.errors import missing_extra

try:
    from numba import njit
except ImportError as error:
    raise missing_extra("numba", "methods", "a method of the survey") from error


def compiled(function: Callable[..., Any]) -> Any:
    """Compile `function` for calls from Python, without the interpreter's lock, so that rows are drawn in threads.

    numba watches the file of `function` only: the functions that it calls stand in the same file.
    """
    try:
        return njit(nogil=True, error_model="numpy", cache=True)(function)
    except RuntimeError:  # neither this package's folder nor the user's cache folder is writable
        return njit(nogil=True, error_model="numpy")(function)


def woven_in(function: Callable[..., Any]) -> Any:
    """Compile `function` into its callers."""
    return njit(nogil=True, error_model="numpy", inline="always")(function)
