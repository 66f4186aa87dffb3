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

from texvol.opengl.contexts import native, trial
from texvol.opengl.contexts.devices import Device, chosen, in_words
from texvol.opengl.contexts.egl import (
    EGL_DRIVER_NAME,
    EGL_DRM_DEVICE_FILE,
    EGL_DRM_RENDER_NODE_FILE,
    EGL_EXTENSIONS,
    EGL_RENDERER,
    Egl,
)
from texvol.opengl.contexts.osmesa import OSMesa
from texvol.util.errors import ContextError, InputError

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
        Number, or part of the name, of one of `devices`, of EGL.

    Raises
    ------
    ContextError
        No context; one line with each back end's reason and the packages that it needs.
    InputError
        No such back end, or no such device; the message lists what there is.
    """
    if backend not in BACKENDS:
        raise InputError(f"backend must be one of {', '.join(BACKENDS)}, got {backend!r}")
    if device is not None:
        if backend == "osmesa":
            raise InputError(f"device {device!r} is one of EGL: leave backend='osmesa' out")
        with _opening:
            return _open(Egl, chosen(device, devices(device)).number)
    reasons: list[str] = []
    with _opening:
        with suppress(ContextError):
            _loaded(Egl)  # also for OSMesa, so that an EGL context, whose ever it is, is left and restored
        for library in _LIBRARIES:
            if backend in ("auto", library.backend):
                try:
                    _try(library)
                    return _open(library)
                except ContextError as reason:
                    reasons.append(f"{library.backend}: {reason} (packages: {library.packages})")
    raise ContextError(f"no OpenGL {native.VERSION_NAME} context; {' | '.join(reasons)}")


def devices(wanted: int | str | None = None) -> list[Device]:
    """Return the devices that EGL lists, each with its name and driver, or the reason why it cannot be used.

    A context is opened on each to learn its name. If `wanted` is the number of one, the list has only that one.

    Raises
    ------
    ContextError
        If there is no EGL, or its driver would end this process.
    """
    with _opening:
        egl = _loaded(Egl)
        assert isinstance(egl, Egl)
        _try(Egl)
        listed = list(enumerate(egl.device_strings()))
        alone = [each for each in listed if str(each[0]) == str(wanted).strip()]
        return [_device(number, strings) for number, strings in alone or listed]


def _device(number: int, strings: dict[int, str]) -> Device:
    """Return a device of EGL, by what EGL tells of it and what a context on it tells."""
    try:
        context = _open(Egl, number)
    except ContextError as error:
        software = "software driver" if "EGL_MESA_device_software" in strings[EGL_EXTENSIONS] else ""
        names = [strings.get(each) for each in (EGL_RENDERER, EGL_DRIVER_NAME, EGL_DRM_DEVICE_FILE)]
        files = [strings.get(each, "") for each in (EGL_DRM_DEVICE_FILE, EGL_DRM_RENDER_NODE_FILE)]
        failure = str(error).removeprefix(f"device {number}: ")
        return Device(number, next(filter(None, [*names, software]), "no name"), "", in_words(failure, files))
    try:
        with context:
            info = context.gl.info
            return Device(number, context.renderer, f"{info['GL_VENDOR']}, OpenGL {info['GL_VERSION']}")
    finally:
        context.release()


def attempt(backend: str) -> None:
    """Open a context of that back end, draw to it and close it; this process may die of it, see `trial`."""
    with suppress(ContextError):
        context = _open(next(each for each in _LIBRARIES if each.backend == backend))
        with context:
            target = context.gl.framebuffer([context.gl.texture((1, 1), 4, dtype="f4")])
            target.clear(1.0)
            target.read(dtype="f4")
        context.release()


def _try(library: type[Egl] | type[OSMesa]) -> None:
    """Raise ContextError if the first context of a library would end this process."""
    if library.backend not in _tried:
        trial.check(library.backend)
        _tried.add(library.backend)


def _open(library: type[Egl] | type[OSMesa], device: int | None = None) -> Context:
    """Return a context on the first display of the library that has one; raise the reasons of all others."""
    reasons = []
    try:
        for handle, display in _loaded(library).handles(device):
            try:
                return Context(handle, library.backend, device)
            except Exception as error:  # moderngl raises nothing narrower
                handle.release()
                reasons.append(f"{display}: {error}")
    except ContextError as reason:
        reasons.append(str(reason))
    raise ContextError(", ".join(reasons))


def _loaded(library: type[Egl] | type[OSMesa]) -> native.Library:
    """Return the library, loaded when first asked for; raise if the system does not have it."""
    if library.backend not in native.loaded:
        native.loaded[library.backend] = library()
    return native.loaded[library.backend]
