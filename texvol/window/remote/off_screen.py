"""Screen of a window without a display: a framebuffer of EGL or OSMesa, whose frames go to an Exchange."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from texvol.opengl.contexts import open_context
from texvol.window.events import Event
from texvol.window.remote.exchange import Exchange
from texvol.window.remote.interface_drawing import InterfaceDrawing

_MOST_WAITING = 256  # events


class OffScreen:
    """The off-screen twin of `texvol.window.screen.Screen`; its context is current on the thread that created it.

    Window coordinates are pixels, as they are with GLFW on X11.
    """

    minimised = False
    is_remote = True
    target: Any = None
    _buffer: Any = None

    def __init__(
        self,
        exchange: Exchange,
        backend: str,
        size: tuple[int, int],
        title: str,
        put: Callable[[Event], int],
        device: int | str | None = None,
    ) -> None:
        self._exchange, self._put = exchange, put
        self._waiting = 0  # events that the window has and has not used yet
        self._size, self._scale = size, 1.0
        self._closers = ExitStack()
        context = open_context(backend, device)
        self._closers.callback(context.release)
        self._closers.enter_context(context)
        self.gl = context.gl
        self._began = time.monotonic()
        self._copies = 0
        self._allocate()
        self.title(title)

    @property
    def size(self) -> tuple[int, int]:
        """Size in window coordinates."""
        return self._size

    @property
    def pixels(self) -> tuple[int, int]:
        """Size of the framebuffer in pixels."""
        return self._size

    @property
    def scale(self) -> float:
        """Scale of text and controls that the viewer's screen asks for, at least 1."""
        return self._scale

    @property
    def time(self) -> float:
        """Seconds since the screen was made."""
        return time.monotonic() - self._began

    def wait(self, seconds: float) -> None:
        """Process events, and wait for an event for at most `seconds`."""
        # A frame uses one event at least; more than the window uses stay in the exchange, which refuses a flood.
        events = self._exchange.wait(seconds, max(_MOST_WAITING - self._waiting, 1))
        wanted = self._exchange.wanted
        if wanted is not None and wanted != (*self._size, self._scale):
            self._scale = wanted[2]
            self.resize((wanted[0], wanted[1]))
            self._put(Event("resize", *self._size))
        for event in events:
            self._waiting = self._put(event)

    def wake(self) -> None:
        """End `wait` early; may be called from any thread."""
        self._exchange.wake()

    def swap(self) -> None:
        """Show the drawn frame to those who look."""
        if self._exchange.watched:
            typing = bool(imgui.get_io().want_text_input)
            self._exchange.show(pixels=self._read(), size=self._size, typing=typing)

    def title(self, text: str) -> None:
        """Set the text of the title bar."""
        self._exchange.show(title=text)

    def resize(self, size: tuple[int, int]) -> None:
        """Set another size."""
        if size != self._size:
            self._size = size
            self._allocate()

    def grow(self, more: int) -> int:
        """Return 0: the size is the viewer's."""
        return 0

    def iconify(self, down: bool) -> None:
        """Do nothing: the browser's window is the viewer's own."""

    def fullscreen(self, on: bool) -> None:
        """Do nothing: a browser fills the screen by a key of its own."""

    def cursor(self, kind: str) -> None:
        """Set the shape of the mouse cursor."""
        self._exchange.show(cursor=kind)

    @property
    def clipboard(self) -> str:
        """Text that a viewer pasted last."""
        return self._exchange.pasted

    def copy(self, text: str) -> None:
        """Hand a text to the viewers' clipboards."""
        self._copies += 1
        self._exchange.pasted = text
        self._exchange.show(copied=(self._copies, text))

    def clear(self, color: tuple[float, float, float]) -> None:
        """Clear the framebuffer."""
        self.target.use()
        self.gl.viewport = (0, 0, *self._size)
        self.target.clear(*color, 1.0)

    def drawing(self) -> InterfaceDrawing:
        """Return the renderer of the interface."""
        return InterfaceDrawing(self)

    def read(self) -> NDArray[np.uint8]:
        """Return the drawn frame, shape (height, width, 3), top row first."""
        width, height = self._size
        return np.frombuffer(self._read(), np.uint8).reshape(height, width, 3)[::-1]

    def check(self) -> None:
        """Raise RuntimeError if OpenGL reports an error."""
        error = self.gl.error
        if error != "GL_NO_ERROR":
            raise RuntimeError(f"OpenGL: {error}")

    def close(self) -> None:
        """Release the context, and send the viewers away."""
        self._exchange.end()
        self._closers.close()

    def _read(self) -> bytes:
        return bytes(self.target.read(components=3, alignment=1))

    def _allocate(self) -> None:
        self.gl.screen.use()  # moderngl binds the last framebuffer again, also one that is gone
        for each in (self.target, self._buffer):
            if each is not None:
                each.release()
        self._buffer = self.gl.renderbuffer(self._size, 4)
        self.target = self.gl.framebuffer([self._buffer])
