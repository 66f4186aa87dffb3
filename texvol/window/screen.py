"""The window on the screen: GLFW and OpenGL 3.3; what happens to it becomes events, pictures become textures."""

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

CURSORS = {"text_input": "IBEAM_CURSOR", "resize_ew": "HRESIZE_CURSOR", "hand": "HAND_CURSOR"}
_NO_WINDOW = "texvol render draws without one: texvol render VOLUME -o IMAGE"


def libraries() -> tuple[Any, Any]:
    """imgui_bundle and glfw, which are to use the same GLFW; or MissingExtraError."""
    try:
        import glfw
        import imgui_bundle  # first: it tells glfw which library
    except ModuleNotFoundError as error:
        raise missing_extra(error.name or "imgui_bundle", "view", "texvol view") from error
    except ImportError as error:  # one of the system's, such as libX11
        raise InputError(f"a window can't be opened: {error}; {_NO_WINDOW}") from None
    return imgui_bundle, glfw


class Screen:
    """A window; its context is current on the thread that made it.

    Parameters
    ----------
    size : (width, height)
        Wanted, in window coordinates; it is made to fit the monitor.
    put : callable
        Gets every event.

    Raises
    ------
    InputError
        If there is no display, or no OpenGL 3.3 on it.
    ContextError
        If the driver would end the process.
    """

    def __init__(self, size: tuple[int, int], title: str, put: Callable[[Event], None]) -> None:
        _, glfw = libraries()
        self._glfw, self._put = glfw, put
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # glfw warns of what the error below says
            if not glfw.init():
                raise InputError(f"there is no display for a window ({_display_text()}); {_NO_WINDOW}")
            for hint, value in (
                (glfw.CONTEXT_VERSION_MAJOR, 3),
                (glfw.CONTEXT_VERSION_MINOR, 3),
                (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
                (glfw.SCALE_TO_MONITOR, glfw.FALSE),
                (glfw.DEPTH_BITS, 0),
                (glfw.STENCIL_BITS, 0),
            ):
                glfw.window_hint(hint, value)
            trial.check("egl")  # the driver is the same one, and would end this process in the same way
            self._window = glfw.create_window(*_fitting(glfw, size), title, None, None)
        if not self._window:
            glfw.terminate()
            raise InputError(f"no window with OpenGL 3.3 can be opened on {_display_text()}; {_NO_WINDOW}")
        glfw.make_context_current(self._window)
        glfw.swap_interval(1)
        import moderngl

        self.gl = moderngl.create_context()
        self.renderer: str = self.gl.info["GL_RENDERER"]
        self._title, self._cursor = title, ""
        self._cursors: dict[str, Any] = {}  # by kind; they end with the library
        self._windowed: Any = None  # place and size, while it fills the monitor
        self._listen()

    @property
    def size(self) -> tuple[int, int]:
        """Window coordinates."""
        width, height = self._glfw.get_window_size(self._window)
        return width, height

    @property
    def pixels(self) -> tuple[int, int]:
        """Pixels of the framebuffer; 0 along both sides where it is minimised."""
        width, height = self._glfw.get_framebuffer_size(self._window)
        return width, height

    @property
    def minimised(self) -> bool:
        """Whether nothing of it can be seen."""
        return 0 in self.pixels or bool(self._glfw.get_window_attrib(self._window, self._glfw.ICONIFIED))

    def fullscreen(self, on: bool) -> None:
        """Fill the monitor, or be a window again."""
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
        """How large letters are to be, as the monitor has it."""
        return max(1.0, float(self._glfw.get_window_content_scale(self._window)[0]))

    @property
    def time(self) -> float:
        """Seconds."""
        return float(self._glfw.get_time())

    def wait(self, seconds: float) -> None:
        """Take what happens, and wait for it at most so long."""
        if seconds > 0:
            self._glfw.wait_events_timeout(seconds)
        else:
            self._glfw.poll_events()

    def wake(self) -> None:
        """End waiting; from any thread."""
        self._glfw.post_empty_event()

    def swap(self) -> None:
        """Show what was drawn."""
        self._glfw.swap_buffers(self._window)

    def title(self, text: str) -> None:
        """What the title bar says."""
        if text != self._title:
            self._title = text
            self._glfw.set_window_title(self._window, text)

    def resize(self, size: tuple[int, int]) -> None:
        """Ask for another size."""
        self._glfw.set_window_size(self._window, *size)

    def iconify(self, down: bool) -> None:
        """Minimise, or bring back."""
        (self._glfw.iconify_window if down else self._glfw.restore_window)(self._window)

    def cursor(self, kind: str) -> None:
        """Another shape of the cursor: one of CURSORS, or an arrow."""
        if kind == self._cursor:
            return
        self._cursor = kind
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # where the system has none of that shape it stays an arrow
            if kind in CURSORS and kind not in self._cursors:
                self._cursors[kind] = self._glfw.create_standard_cursor(getattr(self._glfw, CURSORS[kind]))
            self._glfw.set_cursor(self._window, self._cursors.get(kind))

    @property
    def clipboard(self) -> str:
        """The clipboard's text."""
        text = self._glfw.get_clipboard_string(self._window)
        return text.decode("utf-8", "replace") if text else ""

    @clipboard.setter
    def clipboard(self, text: str) -> None:
        self._glfw.set_clipboard_string(self._window, text)

    def clear(self, color: tuple[float, float, float]) -> None:
        """An empty framebuffer."""
        self.gl.screen.use()
        self.gl.viewport = (0, 0, *self.pixels)
        self.gl.clear(*color, 1.0)

    def read(self) -> NDArray[np.uint8]:
        """What was drawn, before it is shown: (height, width, 3), top row first."""
        width, height = self.pixels
        # By way of another: of the window's own one moderngl 5.13 reads an attachment that it does not have.
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
        """RuntimeError if OpenGL has an error."""
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
        """Modifiers, as far as they are known to the window: those of a drop are not said with it."""
        glfw, ctrl = self._glfw, (self._glfw.KEY_LEFT_CONTROL, self._glfw.KEY_RIGHT_CONTROL)
        return ("ctrl",) if any(glfw.get_key(self._window, key) == glfw.PRESS for key in ctrl) else ()

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
        glfw.set_scroll_callback(window, lambda _, x, y: put(Event("scroll", x, y)))
        glfw.set_key_callback(window, key)
        glfw.set_char_callback(window, lambda _, code: put(Event("text", name=chr(code))))
        glfw.set_drop_callback(window, lambda _, paths: put(Event("drop", names=tuple(paths), modifiers=self._held())))
        glfw.set_window_focus_callback(window, lambda _, has: put(Event("focus", down=bool(has))))
        glfw.set_window_iconify_callback(window, lambda _, is_: put(Event("iconify", down=bool(is_))))
        glfw.set_window_size_callback(window, lambda _, width, height: put(Event("resize", width, height)))
        glfw.set_window_close_callback(window, lambda _: put(Event("close")))


class Texture:
    """A picture on the device; another size makes another texture."""

    def __init__(self, gl: Any) -> None:
        self._gl = gl
        self._texture: Any = None

    @property
    def name(self) -> int:
        """OpenGL's."""
        return int(self._texture.glo) if self._texture is not None else 0

    def write(self, pixels: NDArray[np.uint8]) -> None:
        """Pixels of shape (height, width, 3), top row first."""
        height, width, _ = pixels.shape
        if self._texture is None or self._texture.size != (width, height):
            self.release()
            self._texture = self._gl.texture((width, height), 3, alignment=1)
            self._texture.repeat_x = self._texture.repeat_y = False
        self._texture.write(np.ascontiguousarray(pixels), alignment=1)

    def release(self) -> None:
        """Give it back."""
        if self._texture is not None:
            self._texture.release()
            self._texture = None


class Textures:
    """Pictures by name, uploaded when they have changed."""

    def __init__(self, gl: Any) -> None:
        self._gl = gl
        self._textures: dict[str, tuple[Any, Texture]] = {}

    def get(self, name: str, key: Any, make: Callable[[], NDArray[np.uint8]]) -> int:
        """OpenGL's number of the picture of that name; `make` makes it where `key` is not the last one."""
        before, texture = self._textures.get(name, (None, None))
        if texture is None or before != key:
            texture = texture or Texture(self._gl)
            texture.write(make())
            self._textures[name] = key, texture
        return texture.name

    def release(self) -> None:
        """Give all back."""
        for _, texture in self._textures.values():
            texture.release()
        self._textures.clear()


def key_names(glfw: Any) -> dict[int, str]:
    """Names of GLFW's keys: of what is printed on them in small letters, as `a`, `1`, `page_up`, `kp_add`, `f1`."""
    return {
        getattr(glfw, name): name[4:].lower()
        for name in dir(glfw)
        if name.startswith("KEY_") and name not in ("KEY_LAST", "KEY_UNKNOWN")
    }


def _fitting(glfw: Any, size: tuple[int, int]) -> tuple[int, int]:
    """The size, or as much of it as the monitor has room for."""
    monitor = glfw.get_primary_monitor()
    if not monitor:
        return size
    _, _, width, height = glfw.get_monitor_workarea(monitor)
    return (min(size[0], width) if width else size[0], min(size[1], height) if height else size[1])


def _display_text() -> str:
    named = [f"{name}={os.environ[name]}" for name in ("DISPLAY", "WAYLAND_DISPLAY") if os.environ.get(name)]
    return ", ".join(named) if named else "neither DISPLAY nor WAYLAND_DISPLAY is set"
