"""Values that take longer than a frame, worked out on a thread: of each kind only the newest that is asked for."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, NamedTuple


class _Wanted(NamedTuple):
    """Value to be worked out: its key, how it is made, and who takes it."""

    key: Any
    make: Callable[[], Any]
    done: Callable[[Any], Any] | None


class Counting:
    """Values by slots. A value that is asked for again, of the same key, is known."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: dict[str, tuple[Any, Any]] = {}
        self._wanted: dict[str, _Wanted] = {}
        self._finished: list[tuple[Callable[[Any], Any], Any]] = []
        self._working: tuple[str, Any] | None = None
        self.faults: list[str] = []  # reasons why values can't be had, not yet shown

    @property
    def busy(self) -> bool:
        """True until all values that were asked for are known and taken."""
        with self._lock:
            return bool(self._wanted or self._finished or self._working)

    def ask(
        self, slot: str, key: Any, make: Callable[[], Any], wake: Callable[[], None],
        done: Callable[[Any], Any] | None = None,
    ) -> Any:  # fmt: skip
        """Return the value of a key if it is known, else None, and work it out on the thread.

        Parameters
        ----------
        done : callable, optional
            Takes the value, on the window's thread, in the next `update`.
        """
        with self._lock:
            known = self._known.get(slot)
            if known is not None and known[0] == key:
                if done is not None and known[1] is not None:
                    self._finished.append((done, known[1]))
                return known[1]
            if self._working == (slot, key) and done is None:
                return None
            self._wanted[slot] = _Wanted(key, make, done)
            if self._working is None:
                self._working = ("", None)
                threading.Thread(target=self._work, args=(wake,), daemon=True, name="texvol counting").start()
        return None

    def last(self, slot: str) -> Any:
        """Return the last known value of a slot, which may be of another key."""
        known = self._known.get(slot)
        return None if known is None else known[1]

    def update(self) -> None:
        """Pass values to those who have asked for them."""
        with self._lock:
            finished, self._finished = self._finished, []
        for done, value in finished:
            done(value)

    def forget(self) -> None:
        """Forget all values, and those that are still wanted."""
        with self._lock:
            self._known, self._wanted, self._finished = {}, {}, []

    def _work(self, wake: Callable[[], None]) -> None:
        while True:
            with self._lock:
                if not self._wanted:
                    self._working = None
                    break
                slot = next(iter(self._wanted))
                wanted = self._wanted.pop(slot)
                self._working = slot, wanted.key
            value = self._made(wanted)
            with self._lock:
                self._known[slot] = wanted.key, value
                if wanted.done is not None and value is not None:
                    self._finished.append((wanted.done, value))
            wake()
        wake()

    def _made(self, wanted: _Wanted) -> Any:
        try:
            return wanted.make()
        except Exception as error:  # a store may fail in any way; the window stays open and shows the reason
            self.faults.append(" ".join(str(error).split()) or type(error).__name__)
            return None
