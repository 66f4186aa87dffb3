"""Devices that EGL offers: their names and drivers, and in plain words why one cannot be used.

A device is known by its number, the order in which EGL lists it, or by a part of its name.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from glob import glob

from texvol.opengl.contexts.native import VERSION_NAME
from texvol.util.errors import ContextError, InputError

# Errors of EGL, by what it says, and what is behind them on machines where they were met.
_REASONS: Mapping[str, str] = {
    "EGL_BAD_ACCESS": "this process may not use it: a container sees devices that it was not given, and of a card that "
    "MIG divides only one device can draw",
    "EGL_NOT_INITIALIZED": "its driver does not start: in a container the device files may be missing (--device "
    "/dev/dri; of NVIDIA --gpus all -e NVIDIA_DRIVER_CAPABILITIES=graphics,compute,utility)",
    "EGL_BAD_MATCH": f"its driver has no OpenGL {VERSION_NAME}",
    "EGL_BAD_CONFIG": f"its driver has no OpenGL {VERSION_NAME} without a screen",
    "EGL_BAD_ALLOC": "its memory is full, or the driver has no further context to give",
}
_NVIDIA_FILES = ("/dev/nvidia[0-9]*", "/proc/driver/nvidia/version")
_VENDOR_FILES = ("/usr/share/glvnd/egl_vendor.d/*nvidia*.json", "/etc/glvnd/egl_vendor.d/*nvidia*.json")


@dataclass(frozen=True)
class Device:
    """Device of EGL, as `texvol devices` lists it."""

    number: int
    name: str  # GL_RENDERER, or what EGL knows of a device that cannot be used
    driver: str  # vendor and version of OpenGL; "" if it cannot be used
    reason: str | None = None  # why it cannot be used, in plain words

    @property
    def line(self) -> str:
        """Number, name, driver and reason in a line."""
        about = self.driver if self.reason is None else f"cannot be used: {self.reason}"
        return f"{self.number}  {self.name}  ({about})"


def in_words(failure: str, files: Sequence[str] = ()) -> str:
    """Return the failure of a device in plain words, with EGL's own; `files` are those of the device."""
    closed = [path for path in files if path and os.path.exists(path) and not os.access(path, os.R_OK | os.W_OK)]
    if closed:
        return f"no permission for {closed[0]}; its group, often render or video, has it ({failure})"
    known = next((words for code, words in _REASONS.items() if code in failure), None)
    return failure if known is None else f"{known} ({failure})"


def missing_vendor(found: Callable[[str], list[str]] = glob) -> str | None:
    """Return why no NVIDIA device is listed where there is one; None if nothing is missing."""
    if not any(found(path) for path in _NVIDIA_FILES) or any(found(path) for path in _VENDOR_FILES):
        return None
    return (
        "an NVIDIA card is here, but EGL does not know its driver: the file "
        "/usr/share/glvnd/egl_vendor.d/10_nvidia.json is missing, as in many containers; it holds "
        '{"file_format_version": "1.0.0", "ICD": {"library_path": "libEGL_nvidia.so.0"}}'
    )


def chosen(device: int | str, devices: Sequence[Device]) -> Device:
    """Return the device of that number, or the first usable one with that in its name.

    Raises
    ------
    InputError
        If there is none; the message lists what there is.
    ContextError
        If it cannot be used.
    """
    text = str(device).strip()
    if isinstance(device, bool) or not text:
        found: list[Device] = []
    elif text.isascii() and text.isdigit():
        found = [each for each in devices if each.number == int(text)]
    else:
        found = [each for each in devices if text.lower() in each.name.lower()]
    if not found:
        listed = ", ".join(f"{each.number} ({each.name})" for each in devices) or "none"
        raise InputError(f"device must be the number or a part of the name of one, got {device!r}; there are: {listed}")
    usable = [each for each in found if each.reason is None]
    if not usable:
        raise ContextError(f"device {found[0].number} ({found[0].name}) cannot be used: {found[0].reason}")
    return usable[0]
