"""Work in threads, for functions that release Python's global lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from texvol.util import progress

_Part = TypeVar("_Part")
_Result = TypeVar("_Result")


def in_threads(work: Callable[[_Part], _Result], parts: Sequence[_Part], seconds: float = 0.0) -> list[_Result]:
    """Return `work(part)` for each part, in order; `seconds` is what all take on a usual machine, for the progress.

    An exception, also one of whoever hears the progress, ends the work after the parts that have begun.
    """
    found: list[_Result] = []
    each = seconds / max(len(parts), 1)
    if len(parts) < 2:
        return [work(part) for part in parts]
    try:
        # One thread per core: each thread holds the memory of its part.
        pool = ThreadPoolExecutor(os.cpu_count())
        try:
            for result in pool.map(work, parts):
                found.append(result)
                progress.advance(each)
        finally:
            pool.shutdown(cancel_futures=True)
    except RuntimeError:  # the system has no further thread
        return [work(part) for part in parts]
    return found
