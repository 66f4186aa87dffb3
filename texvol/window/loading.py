"""What is being read from files, on a thread of its own, while the window draws on."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable
from typing import Any

from texvol.util.errors import TexvolError


class Loading:
    """Something that is being read, and what is to be done with it then, on the window's thread.

    Parameters
    ----------
    make : callable
        Reads it, on the other thread.
    done : callable
        Takes it.
    first : bool
        Whether the window has no reason to be without it.
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
        """Begin."""
        threading.Thread(target=self._load, daemon=True, name="texvol loading").start()
        return self

    def _load(self) -> None:
        try:
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("ignore")  # libraries warn of what is nobody's concern here
                warnings.simplefilter("always", UserWarning)
                self.found = self._make()
            self.warnings = [" ".join(str(each.message).split()) for each in said]
        except Exception as error:  # whatever a file makes a reader raise, the window stays
            text = " ".join(str(error).split())
            self.fault = text if isinstance(error, TexvolError) and text else f"{self.name}: {text or error!r}"
        self.over = True
        self._wake()
