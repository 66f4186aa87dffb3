"""Base of EGL and OSMesa contexts: a lock, current on one thread at a time, the previous context restored."""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Callable, Iterator
from typing import Any

from texvol.util.errors import ContextError

OPENGL_VERSION = 3, 3  # the oldest whose shading language the files in shaders/ are written in
VERSION_NAME = ".".join(map(str, OPENGL_VERSION))

# A software driver's threads do not survive a fork: what was opened before would wait for them for ever.
LEFT_BEHIND = "belongs to the process that this one was forked from; start processes with multiprocessing's 'spawn'"

Restore = Callable[[], None]


class Library:
    """A system library that makes contexts; loaded once in a process."""

    backend: str
    packages: str  # what to install where it is missing

    def __init__(
        self, libraries: tuple[str, ...], signatures: dict[str, tuple[Any, ...]], get_proc_address: str
    ) -> None:
        self.process = os.getpid()
        self.functions = open_library(libraries, signatures)
        self._get_proc_address = getattr(self.functions, get_proc_address)
        # The same for all contexts of a library. moderngl 5.13 never lets go of an address that it was given, 21 KiB
        # for each context if they were all new.
        self._addresses = {"glGetStringi": ctypes.cast(_no_string, ctypes.c_void_p).value or 0}

    def opengl_function(self, name: str) -> int:
        """Return the address of an OpenGL function, 0 if the driver lacks it."""
        if name not in self._addresses:
            self._addresses[name] = self._get_proc_address(name.encode()) or 0
        return self._addresses[name]

    def handles(self, device: int | None = None) -> Iterator[tuple[Handle, str]]:
        """Yield a context on each display that has one, with the display's name; raise the reasons of the others.

        `device` is the number of the only one that is tried.
        """
        raise NotImplementedError

    def leave_current(self) -> Restore:
        """Leave this library's context, if one is current on this thread; return what makes it current again."""
        raise NotImplementedError


loaded: dict[str, Library] = {}  # by back end

# moderngl 5.13 asks for the names of all extensions and frees none of them, 17 KiB for each context. The empty string
# costs nothing, Python has it anyway. So gl.extensions is of no use: texvol needs what OpenGL 3.3 has, and no more.
_EMPTY = ctypes.create_string_buffer(1)
_no_string = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_uint, ctypes.c_uint)(
    lambda kind, index: ctypes.addressof(_EMPTY)
)


class Handle:
    """A native context, in the form that moderngl takes: functions by name, entered, left, released."""

    # moderngl holds the handle, and the handle knows nothing above it, so that a Context can be collected.

    def __init__(self, library: Library) -> None:
        self._library = library
        self._turn = threading.RLock()  # held while the context is current; a second thread waits for its turn
        self._before: list[Restore] = []  # one for each `with` that is open
        self._released = False
        self._process = os.getpid()

    def bind(self) -> None:
        """Make the context current on this thread, on which none is."""
        raise NotImplementedError

    def destroy(self) -> None:
        """Free the context, which is current nowhere."""
        raise NotImplementedError

    def load_opengl_function(self, name: str) -> int:
        """Return the address of an OpenGL function, 0 if the driver lacks it."""
        return self._library.opengl_function(name)

    def __enter__(self) -> None:
        if self._process != os.getpid():
            raise ContextError(f"this OpenGL context {LEFT_BEHIND}")
        self._turn.acquire()
        try:
            if self._released:
                raise ContextError("this OpenGL context has been released")
            restore = leave_current()
            try:
                self.bind()
            except BaseException:
                restore()
                raise
            self._before.append(restore)
        except BaseException:
            self._turn.release()
            raise

    def __exit__(self, *_: object) -> None:
        try:
            leave_current()
            self._before.pop()()
            if self._released and not self._before:
                self.destroy()
        finally:
            self._turn.release()

    def release(self) -> None:
        """Free the context, or have it freed when the last `with` leaves it."""
        if self._process != os.getpid():
            return
        with self._turn:
            if not self._released:
                self._released = True
                if not self._before:
                    self.destroy()


def leave_current() -> Restore:
    """Leave no context current on this thread; return what makes the present one current again."""
    # EGL and OSMesa share Mesa's notion of what is current, but each keeps its own books: the one has to be left
    # before the other is entered, or it takes itself for current and does nothing when it is entered again.
    restores = [library.leave_current() for library in list(loaded.values())]

    def restore() -> None:
        for each in restores:
            each()

    return restore


def open_library(names: tuple[str, ...], signatures: dict[str, tuple[Any, ...]]) -> Any:
    """Return the first of the shared libraries that loads, with the (result, *arguments) of its functions set.

    Raises
    ------
    ContextError
        None of them loads, or it lacks one of the functions.
    """
    reasons = []
    for name in names:
        try:
            library = ctypes.CDLL(name)
        except OSError as error:
            reasons.append(str(error))
            continue
        for function, (result, *arguments) in signatures.items():
            if not hasattr(library, function):
                raise ContextError(f"{name} has no {function}, it is too old")
            getattr(library, function).restype = result
            getattr(library, function).argtypes = arguments
        return library
    raise ContextError(", ".join(reasons))


def integers(*values: int) -> Any:
    """Return a C array of ints."""
    return (ctypes.c_int * len(values))(*values)
