"""Reading of files on a thread, while the window goes on drawing."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable
from typing import Any

from texvol.util.errors import TexvolError


class Loading:
    """Reading of one object on a thread; the window's thread takes it over.

    Parameters
    ----------
    make : callable
        Reads and returns the object, on the thread.
    done : callable
        Takes the object, on the window's thread.
    first : bool
        True for the document that the window was started with.
    """

    def __init__(
        self,
        name: str,
        make: Callable[[], Any],
        done: Callable[[Any], None],
        wake: Callable[[], None],
        *,
        first: bool = False,
    ) -> None:
        self.name, self.done, self.first = name, done, first
        self.fault: str | None = None
        self.warnings: list[str] = []
        self.over = False
        self.found: Any = None
        self._make, self._wake = make, wake

    def start(self) -> Loading:
        """Start the thread."""
        threading.Thread(target=self._load, daemon=True, name="texvol loading").start()
        return self

    def _load(self) -> None:
        try:
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("ignore")  # warnings of libraries about themselves
                warnings.simplefilter("always", UserWarning)
                self.found = self._make()
            self.warnings = [" ".join(str(each.message).split()) for each in said]
        except Exception as error:  # a reader may raise anything on a damaged file; the window stays open
            text = " ".join(str(error).split())
            self.fault = text if isinstance(error, TexvolError) and text else f"{self.name}: {text or error!r}"
        self.over = True
        self._wake()
