"""Contexts from EGL: every device, Mesa without a surface, the default display."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator
from ctypes import POINTER, byref, c_char_p, c_int, c_void_p
from functools import partial
from typing import Any

from texvol.opengl.contexts.native import LEFT_BEHIND, OPENGL_VERSION, VERSION_NAME, Handle, Library, Restore, integers
from texvol.util.errors import ContextError

LIBRARIES = ("libEGL.so.1",)  # the plain .so name belongs to the development package

# Values of the EGL 1.5 specification and of its extension registry.
EGL_SUCCESS, EGL_NONE, EGL_EXTENSIONS = 0x3000, 0x3038, 0x3055
EGL_HEIGHT, EGL_WIDTH, EGL_DRAW, EGL_READ = 0x3056, 0x3057, 0x3059, 0x305A
EGL_SURFACE_TYPE, EGL_PBUFFER_BIT = 0x3033, 0x0001
EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_OPENGL_API = 0x3040, 0x0008, 0x30A2
EGL_CONTEXT_MAJOR_VERSION, EGL_CONTEXT_MINOR_VERSION = 0x3098, 0x30FB
EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT = 0x30FD, 0x0001
EGL_PLATFORM_DEVICE_EXT, EGL_PLATFORM_SURFACELESS_MESA = 0x313F, 0x31DD
EGL_DRM_DEVICE_FILE, EGL_DRM_RENDER_NODE_FILE = 0x3233, 0x3377
EGL_VENDOR, EGL_RENDERER, EGL_DRIVER_NAME = 0x3053, 0x335F, 0x335E
DEVICE_STRINGS = {  # by the device's extension that has them; others are an error to ask for
    "EGL_EXT_device_query_name": (EGL_RENDERER, EGL_VENDOR),
    "EGL_EXT_device_persistent_id": (EGL_DRIVER_NAME,),
    "EGL_EXT_device_drm": (EGL_DRM_DEVICE_FILE,),
    "EGL_EXT_device_drm_render_node": (EGL_DRM_RENDER_NODE_FILE,),
}
ERRORS = dict(
    enumerate(
        (
            "EGL_SUCCESS", "EGL_NOT_INITIALIZED", "EGL_BAD_ACCESS", "EGL_BAD_ALLOC", "EGL_BAD_ATTRIBUTE",
            "EGL_BAD_CONFIG", "EGL_BAD_CONTEXT", "EGL_BAD_CURRENT_SURFACE", "EGL_BAD_DISPLAY", "EGL_BAD_MATCH",
            "EGL_BAD_NATIVE_PIXMAP", "EGL_BAD_NATIVE_WINDOW", "EGL_BAD_PARAMETER", "EGL_BAD_SURFACE",
            "EGL_CONTEXT_LOST",
        ),
        start=EGL_SUCCESS,
    )
)  # fmt: skip

SIGNATURES: dict[str, tuple[Any, ...]] = {  # result, arguments
    "eglGetError": (c_int,),
    "eglGetDisplay": (c_void_p, c_void_p),
    "eglGetProcAddress": (c_void_p, c_char_p),
    "eglQueryString": (c_char_p, c_void_p, c_int),
    "eglInitialize": (c_int, c_void_p, c_void_p, c_void_p),
    "eglBindAPI": (c_int, c_int),
    "eglChooseConfig": (c_int, c_void_p, c_void_p, c_void_p, c_int, c_void_p),
    "eglCreateContext": (c_void_p, c_void_p, c_void_p, c_void_p, c_void_p),
    "eglCreatePbufferSurface": (c_void_p, c_void_p, c_void_p, c_void_p),
    "eglDestroyContext": (c_int, c_void_p, c_void_p),
    "eglDestroySurface": (c_int, c_void_p, c_void_p),
    "eglMakeCurrent": (c_int, c_void_p, c_void_p, c_void_p, c_void_p),
    "eglGetCurrentContext": (c_void_p,),
    "eglGetCurrentDisplay": (c_void_p,),
    "eglGetCurrentSurface": (c_void_p, c_int),
}


def _name_of_device(number: int) -> str:
    return f"device {number}"


class Egl(Library):
    """libEGL, and the displays that it has been asked for.

    A display stays initialised until the process ends: EGL gives the same one to everybody in the process, and
    eglTerminate would take it from the others too.
    """

    backend = "egl"
    packages = "Debian, Ubuntu: libegl1 libgl1-mesa-dri; Fedora: mesa-libEGL mesa-dri-drivers"

    def __init__(self) -> None:
        # Mesa writes to stderr about every display that it cannot open; the reasons are in our error.
        os.environ.setdefault("EGL_LOG_LEVEL", "fatal")
        super().__init__(LIBRARIES, SIGNATURES, "eglGetProcAddress")
        self._displays: dict[str, tuple[int, int]] = {}  # name: display, process that initialised it

    def handles(self, device: int | None = None) -> Iterator[tuple[Handle, str]]:
        reasons = []
        for name, get_display in self._displays_on_offer():
            if device is not None and name != _name_of_device(device):
                continue
            try:
                handle = EglHandle(self, self._initialised(name, get_display))
            except ContextError as reason:
                reasons.append(f"{name}: {reason}")
            else:
                yield handle, name
        raise ContextError(", ".join(reasons))

    def leave_current(self) -> Restore:
        functions = self.functions
        functions.eglBindAPI(EGL_OPENGL_API)  # EGL answers for one interface; every thread starts with OpenGL ES
        context = functions.eglGetCurrentContext()
        if not context:
            return lambda: None
        display = functions.eglGetCurrentDisplay()
        surfaces = functions.eglGetCurrentSurface(EGL_DRAW), functions.eglGetCurrentSurface(EGL_READ)
        self.make_current(display, None, None, None)
        return lambda: self.make_current(display, *surfaces, context)

    def make_current(self, display: int, draw: int | None, read: int | None, context: int | None) -> None:
        """Make the context and its surfaces current on this thread."""
        if not self.functions.eglMakeCurrent(display, draw, read, context):
            raise self.failure("eglMakeCurrent")

    def failure(self, function: str) -> ContextError:
        """Return the error of an EGL function that has just failed."""
        code = self.functions.eglGetError()
        return ContextError(f"{function} failed with {ERRORS.get(code, hex(code))}")

    def _displays_on_offer(self) -> Iterator[tuple[str, Callable[[], int | None]]]:
        """Yield the displays that need no screen, then the default one: name, and how to get it."""
        extensions = (self.functions.eglQueryString(None, EGL_EXTENSIONS) or b"").decode().split()
        if "EGL_EXT_platform_base" in extensions:
            get = self._extension("eglGetPlatformDisplayEXT", c_void_p, c_int, c_void_p, c_void_p)
            if "EGL_EXT_platform_device" in extensions:
                for index, device in enumerate(self._devices()):
                    yield _name_of_device(index), partial(get, EGL_PLATFORM_DEVICE_EXT, device, None)
            if "EGL_MESA_platform_surfaceless" in extensions:
                yield "surfaceless", partial(get, EGL_PLATFORM_SURFACELESS_MESA, None, None)
        yield "default display", partial(self.functions.eglGetDisplay, None)

    def device_strings(self) -> list[dict[int, str]]:
        """Return what EGL tells of each device, opened or not: its name, and its files, by enumerant."""
        extensions = (self.functions.eglQueryString(None, EGL_EXTENSIONS) or b"").decode().split()
        if not {"EGL_EXT_platform_base", "EGL_EXT_platform_device"} <= set(extensions):
            return []
        query = self._extension("eglQueryDeviceStringEXT", c_char_p, c_void_p, c_int)
        found = []
        for device in self._devices():
            known = (query(device, EGL_EXTENSIONS) or b"").decode().split()
            names = [name for extension, names in DEVICE_STRINGS.items() if extension in known for name in names]
            strings = {EGL_EXTENSIONS: " ".join(known)}
            found.append(strings | {name: (query(device, name) or b"").decode(errors="replace") for name in names})
        return found

    def _devices(self) -> list[int | None]:
        query = self._extension("eglQueryDevicesEXT", c_int, c_int, POINTER(c_void_p), POINTER(c_int))
        count = c_int(0)
        if not query(0, None, byref(count)):
            return []
        devices = (c_void_p * count.value)()
        query(count.value, devices, byref(count))
        return list(devices)[: count.value]

    def _extension(self, name: str, *signature: Any) -> Any:
        return ctypes.CFUNCTYPE(*signature)(self.functions.eglGetProcAddress(name.encode()))

    def _initialised(self, name: str, get_display: Callable[[], int | None]) -> int:
        if name in self._displays:
            display, process = self._displays[name]
            if process != os.getpid():
                raise ContextError(LEFT_BEHIND)
            return display
        new = get_display()
        if not new:
            raise self.failure("eglGetDisplay")
        if not self.functions.eglInitialize(new, None, None):
            raise self.failure("eglInitialize")
        self._displays[name] = new, os.getpid()
        return new


class EglHandle(Handle):
    """An EGL context with a surface of one pixel, for drivers that insist on one; drawing goes to textures."""

    def __init__(self, egl: Egl, display: int) -> None:
        super().__init__(egl)
        self._egl, self._display = egl, display
        functions = egl.functions
        if not functions.eglBindAPI(EGL_OPENGL_API):
            raise egl.failure("eglBindAPI for OpenGL")
        config = self._config()
        attributes = integers(
            EGL_CONTEXT_MAJOR_VERSION, OPENGL_VERSION[0], EGL_CONTEXT_MINOR_VERSION, OPENGL_VERSION[1],
            EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE,
        )  # fmt: skip
        self._context = functions.eglCreateContext(display, config, None, attributes)
        if not self._context:
            raise egl.failure(f"eglCreateContext for OpenGL {VERSION_NAME}")
        size = integers(EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE)
        self._surface = functions.eglCreatePbufferSurface(display, config, size)
        if not self._surface:
            reason = egl.failure("eglCreatePbufferSurface")
            functions.eglDestroyContext(display, self._context)
            raise reason

    def bind(self) -> None:
        self._egl.make_current(self._display, self._surface, self._surface, self._context)

    def destroy(self) -> None:
        self._egl.functions.eglDestroyContext(self._display, self._context)
        self._egl.functions.eglDestroySurface(self._display, self._surface)

    def _config(self) -> c_void_p:
        config, count = c_void_p(), c_int(0)
        wanted = integers(EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE)
        if not self._egl.functions.eglChooseConfig(self._display, wanted, byref(config), 1, byref(count)):
            raise self._egl.failure("eglChooseConfig")
        if not count.value:
            raise ContextError("it has no OpenGL with an off-screen surface")
        return config
