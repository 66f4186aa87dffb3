"""Work in threads, for what leaves Python's lock alone."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

_Part = TypeVar("_Part")
_Result = TypeVar("_Result")


def in_threads(work: Callable[[_Part], _Result], parts: Sequence[_Part]) -> list[_Result]:
    """What `work` returns for each part."""
    if len(parts) < 2:
        return [work(part) for part in parts]
    try:
        # No more of them than can work at once: each holds what it works on.
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(work, parts))
    except RuntimeError:  # no further thread is to be had: this one does it
        return [work(part) for part in parts]
