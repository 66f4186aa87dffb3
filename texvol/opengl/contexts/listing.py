"""List of devices: each is tried in a process of its own, so that a driver that crashes harms nothing."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

from texvol.opengl.contexts import trial
from texvol.opengl.contexts.devices import Device, name_of, reason_of
from texvol.util.errors import ContextError

FAILURE = "failure"


def devices() -> list[Device]:
    """Return the devices that EGL lists, each with its name and driver, or the reason why it cannot be used.

    Raises
    ------
    ContextError
        If there is no EGL, or listing its devices ends a process.
    """
    found = told("listed")
    if FAILURE in found:
        raise ContextError(found[FAILURE])
    strings = found["strings"]
    with ThreadPoolExecutor(len(strings) or 1) as threads:
        return list(threads.map(partial(_device, strings), range(len(strings))))


def osmesa() -> Device:
    """Return OSMesa as a device without a number: its driver, or the reason why it cannot be used."""
    found = told("osmesa")
    failure = found.get(FAILURE)
    return Device(None, "OSMesa", reason=failure) if failure else _usable(None, found)


def _usable(number: int | None, found: dict[str, Any]) -> Device:
    return Device(number, found["name"], found["driver"], works=tuple(found["works"]))


def _device(strings: list[dict[str, str]], number: int) -> Device:
    """Return a device of EGL, by what EGL tells of it and what a context on it tells."""
    found = told("egl", number)
    failure = found.get(FAILURE)
    if failure is None:
        return _usable(number, found)
    of_device = {int(name): text for name, text in strings[number].items()}
    return Device(number, name_of(of_device), reason=reason_of(failure, number, of_device))


def told(what: str, number: int | None = None) -> dict[str, Any]:
    """Return what a process of its own tells, see `described`; a crash of the driver is a failure, too."""
    try:
        done = trial.apart(f"from texvol.opengl.contexts import described; described.tell({what!r}, {number!r})")
    except (ContextError, OSError) as error:
        return {FAILURE: str(error)}
    lines = done.stdout.decode(errors="replace").splitlines()
    try:
        found: dict[str, Any] = json.loads(lines[-1])
        return found
    except (IndexError, ValueError):
        return {FAILURE: f"the process that tries it ends with status {done.returncode} and says nothing"}
