"""Contexts from OSMesa, Mesa's software driver drawing into memory; it left Mesa in 25.1."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from ctypes import c_char_p, c_int, c_ubyte, c_void_p, create_string_buffer
from typing import Any

from texvol.opengl.contexts.native import LEFT_BEHIND, OPENGL_VERSION, VERSION_NAME, Handle, Library, Restore, integers
from texvol.util.errors import ContextError

LIBRARIES = "libOSMesa.so.8", "libOSMesa.so.6"  # the plain .so name belongs to the development package

# Values of GL/osmesa.h and GL/gl.h.
OSMESA_FORMAT, OSMESA_RGBA, GL_UNSIGNED_BYTE = 0x22, 0x1908, 0x1401
OSMESA_PROFILE, OSMESA_CORE_PROFILE = 0x33, 0x34
OSMESA_CONTEXT_MAJOR_VERSION, OSMESA_CONTEXT_MINOR_VERSION = 0x36, 0x37

SIGNATURES: dict[str, tuple[Any, ...]] = {  # result, arguments
    "OSMesaCreateContextAttribs": (c_void_p, c_void_p, c_void_p),
    "OSMesaDestroyContext": (None, c_void_p),
    "OSMesaMakeCurrent": (c_ubyte, c_void_p, c_void_p, c_int, c_int, c_int),
    "OSMesaGetProcAddress": (c_void_p, c_char_p),
}


class OSMesa(Library):
    """libOSMesa."""

    backend = "osmesa"
    packages = "Debian, Ubuntu: libosmesa6; Fedora: mesa-libOSMesa"

    def __init__(self) -> None:
        super().__init__(LIBRARIES, SIGNATURES, "OSMesaGetProcAddress")
        self.current = threading.local()  # .handle: the one that is current on the thread

    def handles(self, device: int | None = None) -> Iterator[tuple[Handle, str]]:
        if self.process != os.getpid():
            raise ContextError(f"libOSMesa {LEFT_BEHIND}")
        yield OSMesaHandle(self), "memory"

    def leave_current(self) -> Restore:
        # OSMesaGetCurrentContext is not asked: it answers with whatever Mesa has current, an EGL context too.
        handle: OSMesaHandle | None = getattr(self.current, "handle", None)
        if handle is None:
            return lambda: None
        self.functions.OSMesaMakeCurrent(None, None, 0, 0, 0)
        self.current.handle = None
        return handle.bind


class OSMesaHandle(Handle):
    """An OSMesa context with one pixel of memory, since it insists on some; drawing goes to textures."""

    def __init__(self, osmesa: OSMesa) -> None:
        super().__init__(osmesa)
        self._osmesa = osmesa
        self._pixel = create_string_buffer(4)
        attributes = integers(
            OSMESA_FORMAT, OSMESA_RGBA, OSMESA_PROFILE, OSMESA_CORE_PROFILE,
            OSMESA_CONTEXT_MAJOR_VERSION, OPENGL_VERSION[0], OSMESA_CONTEXT_MINOR_VERSION, OPENGL_VERSION[1], 0,
        )  # fmt: skip
        self._context = osmesa.functions.OSMesaCreateContextAttribs(attributes, None)
        if not self._context:
            raise ContextError(f"OSMesaCreateContextAttribs gives no OpenGL {VERSION_NAME}")

    def bind(self) -> None:
        if not self._osmesa.functions.OSMesaMakeCurrent(self._context, self._pixel, GL_UNSIGNED_BYTE, 1, 1):
            raise ContextError("OSMesaMakeCurrent failed")
        self._osmesa.current.handle = self

    def destroy(self) -> None:
        self._osmesa.functions.OSMesaDestroyContext(self._context)
