"""Work in threads, for functions that release Python's global lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

_Part = TypeVar("_Part")
_Result = TypeVar("_Result")


def in_threads(work: Callable[[_Part], _Result], parts: Sequence[_Part]) -> list[_Result]:
    """Return `work(part)` for each part, in order."""
    if len(parts) < 2:
        return [work(part) for part in parts]
    try:
        # One thread per core: each thread holds the memory of its part.
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(work, parts))
    except RuntimeError:  # the system has no further thread
        return [work(part) for part in parts]
