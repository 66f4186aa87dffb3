"""List of devices: each is tried in a process of its own, so that a driver that crashes harms nothing."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

from texvol.opengl import contexts
from texvol.opengl.contexts import trial
from texvol.opengl.contexts.devices import Device, in_words
from texvol.opengl.contexts.egl import (
    EGL_DRIVER_NAME,
    EGL_DRM_DEVICE_FILE,
    EGL_DRM_RENDER_NODE_FILE,
    EGL_EXTENSIONS,
    EGL_RENDERER,
    Egl,
)
from texvol.util.errors import ContextError

_FAILURE = "failure"


def devices() -> list[Device]:
    """Return the devices that EGL lists, each with its name and driver, or the reason why it cannot be used.

    Raises
    ------
    ContextError
        If there is no EGL, or listing its devices ends a process.
    """
    found = told("listed")
    if _FAILURE in found:
        raise ContextError(found[_FAILURE])
    strings = found["strings"]
    with ThreadPoolExecutor(len(strings) or 1) as threads:
        return list(threads.map(partial(_device, strings), range(len(strings))))


def osmesa() -> Device:
    """Return OSMesa as a device without a number: its driver, or the reason why it cannot be used."""
    found = told("osmesa")
    failure = found.pop(_FAILURE, None)
    return Device(None, "OSMesa", reason=failure) if failure else Device(None, **found)


def _device(strings: list[dict[str, str]], number: int) -> Device:
    """Return a device of EGL, by what EGL tells of it and what a context on it tells."""
    found = told("egl", number)
    failure = found.pop(_FAILURE, None)
    if failure is None:
        return Device(number, **found)
    of_device = {int(name): text for name, text in strings[number].items()}
    return Device(number, name_of(of_device), reason=reason_of(failure, number, of_device))


def name_of(strings: Mapping[int, str]) -> str:
    """Return the name of a device that cannot be opened."""
    software = "software driver" if "EGL_MESA_device_software" in strings.get(EGL_EXTENSIONS, "") else ""
    names = [strings.get(each) for each in (EGL_RENDERER, EGL_DRIVER_NAME, EGL_DRM_DEVICE_FILE)]
    return next(filter(None, [*names, software]), "no name")


def reason_of(failure: str, number: int, strings: Mapping[int, str]) -> str:
    """Return in plain words why a device cannot be opened."""
    files = [strings.get(each, "") for each in (EGL_DRM_DEVICE_FILE, EGL_DRM_RENDER_NODE_FILE)]
    return in_words(failure.removeprefix(f"device {number}: "), files)


def told(what: str, number: int | None = None) -> dict[str, Any]:
    """Return what a process of its own tells, see `tell`; a crash of the driver is a failure, too."""
    try:
        done = trial.apart(f"from texvol.opengl.contexts import listing; listing.tell({what!r}, {number!r})")
    except (ContextError, OSError) as error:
        return {_FAILURE: str(error)}
    lines = done.stdout.decode(errors="replace").splitlines()
    try:
        found: dict[str, Any] = json.loads(lines[-1])
        return found
    except (IndexError, ValueError):
        return {_FAILURE: f"the process that tries it ends with status {done.returncode} and says nothing"}


def tell(what: str, number: int | None = None) -> None:
    """Print as JSON, in a process of its own, which devices are "listed", or what one of "egl" or "osmesa" can do."""
    try:
        found = {"strings": _strings()} if what == "listed" else described(what, number)
    except ContextError as error:
        found = {_FAILURE: str(error)}
    print(json.dumps(found))
    sys.stdout.flush()


def _strings() -> list[dict[int, str]]:
    egl = contexts.loaded(Egl)
    assert isinstance(egl, Egl)
    return egl.device_strings()


def described(backend: str, number: int | None) -> dict[str, Any]:
    """Return name, vendor, version and abilities of a device, from a context on it.

    Raises
    ------
    ContextError
        If there is none, or it does not draw.
    """
    context = contexts.opened(backend, number)
    try:
        with context:
            contexts.draw_a_pixel(context)
            info = context.gl.info
            return {
                "name": context.renderer,
                "driver": f"{info['GL_VENDOR']}, OpenGL {info['GL_VERSION']}",
            }
    finally:
        context.release()
