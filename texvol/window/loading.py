"""Reading of files on threads, so that the window draws on meanwhile."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from texvol.util.errors import TexvolError


@dataclass
class Loading:
    """Reading of one object on a thread; the window's thread takes it over.

    Attributes
    ----------
    make : callable
        Reads and returns the object, on the thread.
    done : callable
        Takes the object, on the window's thread.
    first : bool
        True for the document that the window was started with.
    over : bool
        True once the object is `found`, or the reading has failed because of a `fault`.
    """

    name: str
    make: Callable[[], Any]
    done: Callable[[Any], None]
    wake: Callable[[], None]
    first: bool = False
    fault: str | None = None
    warnings: list[str] = field(default_factory=list)
    over: bool = False
    found: Any = None

    def start(self) -> Loading:
        """Start the thread."""
        threading.Thread(target=self._load, daemon=True, name="texvol loading").start()
        return self

    def _load(self) -> None:
        try:
            with warnings.catch_warnings(record=True) as said:
                warnings.simplefilter("ignore")  # warnings of libraries about themselves
                warnings.simplefilter("always", UserWarning)
                self.found = self.make()
            self.warnings = [" ".join(str(each.message).split()) for each in said]
        except Exception as error:  # a reader may raise anything on a damaged file; the window stays open
            text = " ".join(str(error).split())
            self.fault = text if isinstance(error, TexvolError) and text else f"{self.name}: {text or error!r}"
        self.over = True
        self.wake()
