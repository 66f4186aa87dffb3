"""Window on the screen, by GLFW and OpenGL 3.3: it reports input as events, and shows pictures as textures."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.contexts import trial
from texvol.util.errors import InputError, missing_extra
from texvol.window.events import BUTTONS, Event
from texvol.window.home import Home

CURSORS = {"text_input": "IBEAM_CURSOR", "resize_ew": "HRESIZE_CURSOR", "hand": "HAND_CURSOR"}
_NO_WINDOW = "to draw without a window, use: texvol render VOLUME -o IMAGE"
_MOST_TIMES = 16  # a pixel is repeated along each side: a sixteenth of it is blurred then
_MOST_ENLARGED = 1 << 20  # pixels: more than a view shows, made and uploaded within a few milliseconds


def _library() -> Any:
    """Return the module glfw, which shares one GLFW with imgui_bundle; raise MissingExtraError if one is missing."""
    try:
        import glfw
        import imgui_bundle  # noqa: F401 (before the first call of glfw: it sets which library glfw uses)
    except ModuleNotFoundError as error:
        raise missing_extra(error.name or "imgui_bundle", "view", "texvol view") from error
    except ImportError as error:  # a system library, such as libX11, is missing
        raise InputError(f"cannot open a window: {error}; {_NO_WINDOW}") from None
    return glfw


class Screen:
    """Window whose OpenGL context is current on the thread that created it.

    Parameters
    ----------
    size : (width, height)
        Requested size in window coordinates; it is reduced to fit the monitor.
    put : callable
        Called with each event.

    Raises
    ------
    InputError
        If there is no display, or no OpenGL 3.3 on it.
    ContextError
        If the driver would end the process.
    """

    is_remote = False

    def __init__(self, size: tuple[int, int], title: str, put: Callable[[Event], int]) -> None:
        glfw = self._glfw = _library()
        self._put = put
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # glfw warns of the errors that are raised below
            if not glfw.init():
                raise InputError(f"cannot open a window: no display found ({_display_text()}); {_NO_WINDOW}")
            hints = {
                glfw.CONTEXT_VERSION_MAJOR: 3, glfw.CONTEXT_VERSION_MINOR: 3,
                glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE, glfw.SCALE_TO_MONITOR: glfw.FALSE,
                glfw.DEPTH_BITS: 0, glfw.STENCIL_BITS: 0,
            }  # fmt: skip
            for hint, value in hints.items():
                glfw.window_hint(hint, value)
            trial.check("egl")  # the window's driver is the driver of EGL, and may end the process in the same way
            self._window = glfw.create_window(*_fitting(glfw, size), title, None, None)
        if not self._window:
            glfw.terminate()
            raise InputError(f"cannot open a window with OpenGL 3.3 on {_display_text()}; {_NO_WINDOW}")
        glfw.make_context_current(self._window)
        glfw.swap_interval(1)
        import moderngl

        self.gl = moderngl.create_context()
        self._title, self._cursor = title, ""
        self._cursors: dict[str, Any] = {}  # by kind; glfw.terminate destroys them
        self._windowed: Any = None  # position and size of the window, while it fills the monitor
        self._listen()

    @property
    def size(self) -> tuple[int, int]:
        """Size in window coordinates."""
        width, height = self._glfw.get_window_size(self._window)
        return width, height

    @property
    def pixels(self) -> tuple[int, int]:
        """Size of the framebuffer in pixels; (0, 0) if the window is minimised."""
        width, height = self._glfw.get_framebuffer_size(self._window)
        return width, height

    @property
    def minimised(self) -> bool:
        """True if the window is minimised or has no pixels."""
        return 0 in self.pixels or bool(self._glfw.get_window_attrib(self._window, self._glfw.ICONIFIED))

    def fullscreen(self, on: bool) -> None:
        """Fill the monitor, or return to the size before."""
        glfw, monitor = self._glfw, self._glfw.get_primary_monitor()
        if on == (self._windowed is not None) or not monitor:
            return
        if on:
            self._windowed = (*glfw.get_window_pos(self._window), *self.size)
            mode = glfw.get_video_mode(monitor)
            glfw.set_window_monitor(self._window, monitor, 0, 0, *mode.size, mode.refresh_rate)
        else:
            glfw.set_window_monitor(self._window, None, *self._windowed, 0)
            self._windowed = None

    @property
    def scale(self) -> float:
        """Scale of text and controls that the monitor asks for, at least 1."""
        return max(1.0, float(self._glfw.get_window_content_scale(self._window)[0]))

    @property
    def time(self) -> float:
        """Seconds since GLFW was initialised."""
        return float(self._glfw.get_time())

    def wait(self, seconds: float) -> None:
        """Process events, and wait for an event for at most `seconds`."""
        if seconds > 0:
            self._glfw.wait_events_timeout(seconds)
        else:
            self._glfw.poll_events()

    def wake(self) -> None:
        """End `wait` early; may be called from any thread."""
        self._glfw.post_empty_event()

    def swap(self) -> None:
        """Show the drawn frame."""
        self._glfw.swap_buffers(self._window)

    def title(self, text: str) -> None:
        """Set the text of the title bar."""
        if text != self._title:
            self._title = text
            self._glfw.set_window_title(self._window, text)

    def resize(self, size: tuple[int, int]) -> None:
        """Request another size, unless the window is maximised; window and frame stay on the monitor's work area."""
        area = self._area()
        if area is None:
            return
        left, top, right, bottom = area
        width, height = min(size[0], right - left), min(size[1], bottom - top)
        self._glfw.set_window_size(self._window, width, height)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # on Wayland, the compositor alone places windows
            x, y = self._glfw.get_window_pos(self._window)
            place = min(x, right - width), min(y, bottom - height)
            if place != (x, y) and left <= x < right and top <= y < bottom:  # else it is on another monitor
                self._glfw.set_window_pos(self._window, *place)

    def grow(self, more: int) -> int:
        """Make the window taller at its foot, or shorter; return by how much: it stays on the monitor's work area."""
        area = self._area()
        if area is None:
            return 0
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Wayland tells no position
            foot = self._glfw.get_window_pos(self._window)[1] + self.size[1]
        more = min(more, max(area[3] - foot, 0))
        self._glfw.set_window_size(self._window, self.size[0], self.size[1] + more)
        return more

    def _area(self) -> tuple[int, int, int, int] | None:
        """Return the edges (left, top, right, bottom) that the window without its frame may have; None if it is full.

        A window whose monitor is not known has no edges.
        """
        glfw, window, monitor = self._glfw, self._window, self._glfw.get_primary_monitor()
        if self._windowed is not None or glfw.get_window_attrib(window, glfw.MAXIMIZED):
            return None
        x, y, width, height = glfw.get_monitor_workarea(monitor) if monitor else (0, 0, 0, 0)
        left, top, right, bottom = glfw.get_window_frame_size(window)
        far = 1 << 16
        return x + left, y + top, (x + width or far) - right, (y + height or far) - bottom

    def iconify(self, down: bool) -> None:
        """Minimise the window if `down` is True, else restore it."""
        (self._glfw.iconify_window if down else self._glfw.restore_window)(self._window)

    def cursor(self, kind: str) -> None:
        """Set the shape of the mouse cursor: one of CURSORS, or else an arrow."""
        if kind == self._cursor:
            return
        self._cursor = kind
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a system without that shape keeps the arrow
            if kind in CURSORS and kind not in self._cursors:
                self._cursors[kind] = self._glfw.create_standard_cursor(getattr(self._glfw, CURSORS[kind]))
            self._glfw.set_cursor(self._window, self._cursors.get(kind))

    @property
    def clipboard(self) -> str:
        """Text of the clipboard."""
        text = self._glfw.get_clipboard_string(self._window)
        return text.decode("utf-8", "replace") if text else ""

    def copy(self, text: str) -> None:
        """Set the text of the clipboard."""
        self._glfw.set_clipboard_string(self._window, text)

    def clear(self, color: tuple[float, float, float]) -> None:
        """Clear the framebuffer."""
        self.gl.screen.use()
        self.gl.viewport = (0, 0, *self.pixels)
        self.gl.clear(*color, 1.0)

    @property
    def target(self) -> Any:
        """Framebuffer that is drawn into."""
        return self.gl.screen

    def drawing(self) -> None:
        """Return None: Dear ImGui's own renderer draws into a window of GLFW."""

    def read(self) -> NDArray[np.uint8]:
        """Return the drawn frame, shape (height, width, 3), top row first; call it before `swap`."""
        width, height = self.pixels
        # A copy is read: from the window's framebuffer, moderngl 5.13 reads an attachment that does not exist.
        buffer = self.gl.renderbuffer((width, height), 3)
        copy = self.gl.framebuffer([buffer])
        try:
            self.gl.copy_framebuffer(copy, self.gl.screen)
            data = copy.read(components=3, alignment=1)
        finally:
            self.gl.screen.use()
            copy.release()
            buffer.release()
        return np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]

    def check(self) -> None:
        """Raise RuntimeError if OpenGL reports an error."""
        error = self.gl.error
        if error != "GL_NO_ERROR":
            raise RuntimeError(f"OpenGL: {error}")

    def close(self) -> None:
        """Close the window."""
        if self._window:
            self.gl.release()
            self._glfw.destroy_window(self._window)
            self._window = None
            self._glfw.terminate()

    def _held(self) -> tuple[str, ...]:
        """Return the modifier keys that are down; GLFW reports none with a drop or a turn of the wheel."""
        glfw, names = self._glfw, {"shift": "SHIFT", "ctrl": "CONTROL", "alt": "ALT"}
        return tuple(
            name
            for name, key in names.items()
            for side in ("LEFT", "RIGHT")
            if glfw.get_key(self._window, getattr(glfw, f"KEY_{side}_{key}")) == glfw.PRESS
        )

    def _listen(self) -> None:
        glfw, window, put = self._glfw, self._window, self._put

        def modifiers(bits: int) -> tuple[str, ...]:
            masks = (("shift", glfw.MOD_SHIFT), ("ctrl", glfw.MOD_CONTROL), ("alt", glfw.MOD_ALT))
            return tuple(name for name, mask in masks if bits & mask)

        def button(_: Any, number: int, action: int, bits: int) -> None:
            if number < len(BUTTONS):
                put(Event("button", name=BUTTONS[number], down=action == glfw.PRESS, modifiers=modifiers(bits)))

        names = key_names(glfw)

        def key(_: Any, number: int, _code: int, action: int, bits: int) -> None:
            if number in names:
                put(Event("key", name=names[number], down=action != glfw.RELEASE, modifiers=modifiers(bits)))

        glfw.set_cursor_pos_callback(window, lambda _, x, y: put(Event("move", x, y)))
        glfw.set_mouse_button_callback(window, button)
        glfw.set_scroll_callback(window, lambda _, x, y: put(Event("scroll", x, y, modifiers=self._held())))
        glfw.set_key_callback(window, key)
        glfw.set_char_callback(window, lambda _, code: put(Event("text", name=chr(code))))
        glfw.set_drop_callback(window, lambda _, paths: put(Event("drop", names=tuple(paths), modifiers=self._held())))
        glfw.set_window_focus_callback(window, lambda _, has: put(Event("focus", down=bool(has))))
        glfw.set_window_iconify_callback(window, lambda _, is_: put(Event("iconify", down=bool(is_))))
        glfw.set_window_size_callback(window, lambda _, width, height: put(Event("resize", width, height)))
        glfw.set_window_close_callback(window, lambda _: put(Event("close")))


class Textures:
    """Textures by name, uploaded again if they have changed."""

    def __init__(self, home: Home) -> None:
        self._home = home
        self.gl = home.gl
        self._textures: dict[str, tuple[Any, Any]] = {}  # key, and texture
        self._replaced: list[Any] = []  # textures that lists of this frame may name

    @property
    def target(self) -> Any:
        """Framebuffer of the window."""
        return self._home.target

    def get(self, name: str, key: Any, make: Callable[[], NDArray[np.uint8]], *, nearest: bool = False) -> int:
        """Return the OpenGL name of a texture, see `texture`."""
        return int(self.texture(name, key, make, nearest=nearest).glo)

    def texture(self, name: str, key: Any, make: Callable[[], NDArray[np.uint8]], *, nearest: bool = False) -> Any:
        """Return a texture; `make` returns its pixels if `key` differs from the last call.

        Pixels have shape (height, width, 3 or 4), or (height, width) for grey, top row first; pixels of another shape
        get another texture. They are interpolated unless `nearest` is True.
        """
        before, texture = self._textures.get(name, (None, None))
        if texture is None or before != key:
            pixels = enlarged(make()) if nearest else make()
            height, width, *further = pixels.shape
            components = further[0] if further else 1
            if texture is None or (texture.size, texture.components) != ((width, height), components):
                if texture is not None:
                    self._replaced.append(texture)
                texture = self.gl.texture((width, height), components, alignment=1)
                texture.repeat_x = texture.repeat_y = False
                texture.swizzle = "RRR1" if components == 1 else texture.swizzle
            how = self.gl.NEAREST if nearest else self.gl.LINEAR
            texture.filter = how, how
            texture.write(np.ascontiguousarray(pixels), alignment=1)
            self._textures[name] = key, texture
        return texture

    def drawn(self) -> None:
        """Release the textures that others have replaced; call it after a frame is drawn."""
        while self._replaced:
            self._replaced.pop().release()


def enlarged(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return pixels repeated along both sides, so that a filter that interpolates blurs a small part of each only.

    Dear ImGui's renderer binds a linear sampler for OpenGL 3.3, whatever the filter of the texture is.
    """
    height, width = pixels.shape[:2]
    times = int(np.clip(np.sqrt(_MOST_ENLARGED / max(height * width, 1)), 1, _MOST_TIMES))
    return pixels.repeat(times, axis=0).repeat(times, axis=1) if times > 1 else pixels


def key_names(glfw: Any) -> dict[int, str]:
    """Return the names of GLFW's key numbers in lower case, such as `a`, `1`, `page_up`, `kp_add` and `f1`."""
    return {
        getattr(glfw, name): name[4:].lower()
        for name in dir(glfw)
        if name.startswith("KEY_") and name not in ("KEY_LAST", "KEY_UNKNOWN")
    }


def _fitting(glfw: Any, size: tuple[int, int]) -> tuple[int, int]:
    """Return the size, reduced to the monitor's work area."""
    monitor = glfw.get_primary_monitor()
    if not monitor:
        return size
    _, _, width, height = glfw.get_monitor_workarea(monitor)
    return (min(size[0], width) if width else size[0], min(size[1], height) if height else size[1])


def _display_text() -> str:
    named = [f"{name}={os.environ[name]}" for name in ("DISPLAY", "WAYLAND_DISPLAY") if os.environ.get(name)]
    return ", ".join(named) if named else "neither DISPLAY nor WAYLAND_DISPLAY is set"
