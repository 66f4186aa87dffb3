"""Home of a window: what the main loop needs of a screen, be it GLFW's or one without a display."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


class Drawing(Protocol):
    """Renderer of Dear ImGui's lists."""

    def begin(self) -> None:
        """Begin a frame."""

    def draw(self, data: Any) -> None:
        """Draw the lists of a frame."""

    def close(self) -> None:
        """Release what is held for Dear ImGui's context."""


class Home(Protocol):
    """Screen of a window; `texvol.window.screen.Screen` describes the members."""

    gl: Any
    is_remote: bool

    @property
    def target(self) -> Any: ...

    @property
    def size(self) -> tuple[int, int]: ...

    @property
    def pixels(self) -> tuple[int, int]: ...

    @property
    def minimised(self) -> bool: ...

    @property
    def scale(self) -> float: ...

    @property
    def time(self) -> float: ...

    @property
    def clipboard(self) -> str: ...

    def wait(self, seconds: float) -> None: ...

    def wake(self) -> None: ...

    def swap(self) -> None: ...

    def title(self, text: str) -> None: ...

    def resize(self, size: tuple[int, int]) -> None: ...

    def grow(self, more: int) -> int: ...

    def iconify(self, down: bool) -> None: ...

    def fullscreen(self, on: bool) -> None: ...

    def cursor(self, kind: str) -> None: ...

    def copy(self, text: str) -> None: ...

    def clear(self, color: tuple[float, float, float]) -> None: ...

    def drawing(self) -> Drawing | None: ...

    def read(self) -> NDArray[np.uint8]: ...

    def check(self) -> None: ...

    def close(self) -> None: ...
