"""Seconds that the steps of a picture take, by name."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Adds up seconds by name."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def timed(self, what: str) -> Iterator[None]:
        """Add the time that is spent inside."""
        start = time.perf_counter()
        yield
        self.seconds[what] = self.seconds.get(what, 0.0) + time.perf_counter() - start

    def of_textures(self) -> float:
        """Seconds in which texels were made and uploaded."""
        return self.seconds.get("bake", 0.0) + self.seconds.get("upload", 0.0)
