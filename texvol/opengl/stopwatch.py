"""Seconds that the steps of a picture take, by name; textures keep their own."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from texvol.opengl.texture_store import TextureStore


class Stopwatch:
    """Adds up seconds by name.

    Parameters
    ----------
    stores : callable
        Gives the textures in use, whose own seconds count as well.
    """

    def __init__(self, stores: Callable[[], Sequence[TextureStore]]) -> None:
        self._stores = stores
        self.seconds: dict[str, float] = {}

    @contextmanager
    def timed(self, what: str) -> Iterator[None]:
        """Add the time that is spent inside."""
        start = time.perf_counter()
        yield
        self._add(what, time.perf_counter() - start)

    @contextmanager
    def baking(self) -> Iterator[None]:
        """Add what textures take inside, by their own names."""
        before = {id(store): dict(store.seconds) for store in self._stores()}
        yield
        for store in self._stores():
            earlier = before.get(id(store), {})
            for what, seconds in store.seconds.items():
                if seconds > earlier.get(what, 0.0):
                    self._add(what, seconds - earlier.get(what, 0.0))

    def of_textures(self) -> float:
        """Seconds that all textures have taken so far."""
        return sum(sum(store.seconds.values()) for store in self._stores())

    def _add(self, what: str, seconds: float) -> None:
        self.seconds[what] = self.seconds.get(what, 0.0) + seconds
