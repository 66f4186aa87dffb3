"""OpenGL contexts without a screen, from EGL or OSMesa; one that cannot be had says why, and which package is missing.

A context is current only inside `with context:`, on the thread that entered it; leaving restores what was current
before, a context of texvol's or anybody's EGL context. So one context may serve several threads in turn, and several
contexts may be alive in one process.

The system's libraries are called directly. glcontext stops at the first device that fails, and GLFW, another way to
OSMesa, keeps one platform for the whole process, so that no window could be opened afterwards.
"""

from __future__ import annotations

import ctypes
import threading
import weakref
from contextlib import suppress
from typing import Any

import moderngl
import numpy as np

from texvol.opengl.contexts import native, trial
from texvol.opengl.contexts.devices import Device, chosen, hindrances, name_of, number_of, reason_of
from texvol.opengl.contexts.egl import Egl
from texvol.opengl.contexts.osmesa import OSMesa
from texvol.util.errors import ContextError, InputError
from texvol.util.suggestions import check_one_of

__all__ = ["BACKENDS", "Context", "devices", "open_context"]

BACKENDS = ("auto", "egl", "osmesa")

_LIBRARIES: tuple[type[Egl] | type[OSMesa], ...] = (Egl, OSMesa)  # in the order of "auto"
_TEXTURE_3D, _WRAP_R = 0x806F, 0x8072
_MIRROR_CLAMP, _MIRRORED_REPEAT = 0x8743, 0x8370  # the first is quicker
_MIRROR_CLAMP_SINCE = 440  # OpenGL 4.4
_tried: set[str] = set()  # back ends of which a context does not end the process
_opening = threading.RLock()  # a finaliser may open and close contexts too


class Context:
    """An OpenGL context and where it comes from; current inside `with context:`.

    Attributes
    ----------
    gl : moderngl.Context
        To be used while current only.
    backend : str
        "egl" or "osmesa".
    renderer : str
        GL_RENDERER.
    device : int or None
        Number of the device that was asked for.
    """

    def __init__(self, handle: native.Handle, backend: str, device: int | None = None) -> None:
        loader: Any = handle  # moderngl's stub wants a dict; its code wants an object with these methods
        self._handle = handle
        self.backend, self.device = backend, device
        with handle:
            self.gl: moderngl.Context = moderngl.create_context(context=loader)
            self.renderer: str = self.gl.info["GL_RENDERER"]
        # Freed when nobody holds it any more; not at exit, where another thread may still be drawing.
        self._release = weakref.finalize(self, self.gl.release)
        self._release.atexit = False

    def __enter__(self) -> Context:
        self._handle.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._handle.__exit__()

    def integer(self, name: int) -> int:
        """A number of the driver's by its OpenGL enumerant, for what moderngl has no name for; 0 where unknown."""
        address = self._handle.load_opengl_function("glGetIntegerv")
        if not address:
            return 0
        numbers = (ctypes.c_int * 4)()  # some have four
        ctypes.CFUNCTYPE(None, ctypes.c_uint, ctypes.POINTER(ctypes.c_int))(address)(name, numbers)
        _ = self.gl.error  # that of an unknown one, which reading forgets
        return int(numbers[0])

    def interpolate_in_single_precision(self, texture: moderngl.Texture3D) -> None:
        """Have Mesa's software driver not interpolate a texture of 8 bits with weights of 8 bits.

        It does so only where all coordinates wrap by repeating or clamping. Mirrored about its low edge and clamped at
        the high one a texture is the same as clamped for a texel's length beyond it, and nothing is fetched from there.
        """
        texture.use(0)
        address = self._handle.load_opengl_function("glTexParameteri")
        mode = _MIRROR_CLAMP if self.gl.version_code >= _MIRROR_CLAMP_SINCE else _MIRRORED_REPEAT
        ctypes.CFUNCTYPE(None, ctypes.c_uint, ctypes.c_uint, ctypes.c_int)(address)(_TEXTURE_3D, _WRAP_R, mode)

    @property
    def released(self) -> bool:
        """True if the context has been released."""
        return not self._release.alive

    def release(self) -> None:
        """Free the context and every OpenGL object in it; once is enough, and a second time does nothing."""
        self._release()


def open_context(backend: str = "auto", device: int | str | None = None) -> Context:
    """Return a new OpenGL context that needs no screen; it is not current yet.

    Parameters
    ----------
    backend : str
        "egl", "osmesa", or "auto": the first of them that works.
    device : int or str, optional
        Number, or part of the name, of one of `devices`, of EGL; to find a name, all are tried.

    Raises
    ------
    ContextError
        No context; one line with each back end's reason and the packages that it needs.
    InputError
        No such back end, or no such device; the message lists what there is.
    """
    check_one_of("backend", backend, BACKENDS)
    if device is not None:
        if backend == "osmesa":
            raise InputError(f"device {device!r} is one of EGL: leave backend='osmesa' out")
        with _opening:
            return _open_device(device)
    reasons: list[str] = []
    with _opening:
        with suppress(ContextError):
            loaded(Egl)  # also for OSMesa, so that an EGL context, whose ever it is, is left and restored
        for library in _LIBRARIES:
            if backend in ("auto", library.backend):
                try:
                    _try(library)
                    return _open(library)
                except ContextError as reason:
                    reasons.append(f"{library.backend}: {reason} (packages: {library.packages})")
    raise ContextError(f"no OpenGL {native.VERSION_NAME} context; {' | '.join(reasons)}")


def devices() -> list[Device]:
    """Return the devices that EGL lists, see `listing.devices`."""
    from texvol.opengl.contexts import listing

    return listing.devices()


def attempt(backend: str) -> None:
    """Open a context of that back end, draw to it and close it; this process may die of it, see `trial`."""
    with suppress(ContextError):
        context = opened(backend)
        with context:
            draw_a_pixel(context)
        context.release()


def draw_a_pixel(context: Context) -> None:
    """Clear and read a picture of one pixel, as pictures are; `context` is current.

    Raises
    ------
    ContextError
        If it is not what it was cleared to.
    """
    try:
        target = context.gl.framebuffer([context.gl.texture((1, 1), 4, dtype="f4")])
        target.clear(0.25)
        is_right = np.frombuffer(target.read(components=4, dtype="f4"), np.float32)[0] == 0.25
        for each in (*target.color_attachments, target):
            each.release()
    except moderngl.Error as error:
        raise ContextError(f"it has no pictures of float32: {error}") from None
    if not is_right:
        raise ContextError("it does not draw: a cleared pixel has another colour")


def opened(backend: str, device: int | None = None) -> Context:
    """Return a context of a back end, on a device by its number; raise ContextError if there is none."""
    return _open(next(each for each in _LIBRARIES if each.backend == backend), device)


def _open_device(device: int | str) -> Context:
    """Return a context on a device of EGL; see `open_context` for errors."""
    egl, number = loaded(Egl), number_of(device)
    assert isinstance(egl, Egl)
    _try(Egl)
    strings = egl.device_strings()
    if number is None or number >= len(strings):
        number = chosen(device, devices(), hindrances()).number
    assert number is not None
    try:
        return _open(Egl, number)
    except ContextError as error:
        reason = reason_of(str(error), number, strings[number])
        raise ContextError(f"device {number} ({name_of(strings[number])}) cannot be used: {reason}") from None


def _try(library: type[Egl] | type[OSMesa]) -> None:
    """Raise ContextError if the first context of a library would end this process."""
    if library.backend not in _tried:
        trial.check(library.backend)
        _tried.add(library.backend)


def _open(library: type[Egl] | type[OSMesa], device: int | None = None) -> Context:
    """Return a context on the first display of the library that has one; raise the reasons of all others."""
    reasons = []
    try:
        for handle, display in loaded(library).handles(device):
            try:
                return Context(handle, library.backend, device)
            except Exception as error:  # moderngl raises nothing narrower
                handle.release()
                reasons.append(f"{display}: {error}")
    except ContextError as reason:
        reasons.append(str(reason))
    raise ContextError(", ".join(reasons))


def loaded(library: type[Egl] | type[OSMesa]) -> native.Library:
    """Return the library, loaded when first asked for; raise if the system does not have it."""
    if library.backend not in native.loaded:
        native.loaded[library.backend] = library()
    return native.loaded[library.backend]
