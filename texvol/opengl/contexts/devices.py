"""Devices that EGL offers: their names and drivers, and in plain words why one cannot be used.

A device is known by its number, the order in which EGL lists it, or by a part of its name.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from glob import glob

from texvol.opengl.contexts.egl import (
    EGL_DRIVER_NAME,
    EGL_DRM_DEVICE_FILE,
    EGL_DRM_RENDER_NODE_FILE,
    EGL_EXTENSIONS,
    EGL_RENDERER,
)
from texvol.opengl.contexts.native import VERSION_NAME
from texvol.util.errors import ContextError, InputError

# Errors of EGL, by what it says, and what is behind them on machines where they were met.
_REASONS: Mapping[str, str] = {
    "EGL_BAD_ACCESS": "this process may not use it: a container sees devices that it was not given, and most cards "
    "that MIG divides offer no graphics",
    "EGL_NOT_INITIALIZED": "its driver does not start: in a container the device files may be missing (--device "
    "/dev/dri; of NVIDIA --gpus all -e NVIDIA_DRIVER_CAPABILITIES=graphics,compute,utility)",
    "EGL_BAD_MATCH": f"its driver has no OpenGL {VERSION_NAME}",
    "EGL_BAD_CONFIG": f"its driver has no OpenGL {VERSION_NAME} without a screen",
    "EGL_BAD_ALLOC": "its memory is full, or the driver has no further context to give",
}
_NVIDIA_FILES = ("/dev/nvidia[0-9]*", "/proc/driver/nvidia/version")
_VENDOR_FILES = ("/usr/share/glvnd/egl_vendor.d/*nvidia*.json", "/etc/glvnd/egl_vendor.d/*nvidia*.json")
_NVIDIA_LIBRARY = "libEGL_nvidia.so.0"
_CAPABILITIES = "NVIDIA_DRIVER_CAPABILITIES"
_MIG_FILES = ("/proc/driver/nvidia/capabilities/gpu*/mig/gi*",)
_MIG_VARIABLES = ("NVIDIA_VISIBLE_DEVICES", "CUDA_VISIBLE_DEVICES")
_DRM_FILES, _RENDER_NODES = "/dev/dri/*", "/dev/dri/renderD*"


@dataclass(frozen=True)
class Device:
    """Device of EGL, or OSMesa, as `texvol devices` lists it."""

    number: int | None  # None: OSMesa, which --backend osmesa chooses
    name: str  # GL_RENDERER, or what EGL knows of a device that cannot be used
    driver: str = ""  # vendor and version of OpenGL; "" if it cannot be used
    reason: str | None = None  # why it cannot be used, in plain words
    works: tuple[str, ...] = ()  # what it can do beside drawing, and how exactly it interpolates

    @property
    def line(self) -> str:
        """Number, name, driver and reason in a line."""
        about = "; ".join([self.driver, *self.works]) if self.reason is None else f"cannot be used: {self.reason}"
        return f"{'osmesa' if self.number is None else self.number}  {self.name}  ({about})"


def in_words(failure: str, files: Sequence[str] = ()) -> str:
    """Return the failure of a device in plain words, with EGL's own; `files` are those of the device."""
    closed = [path for path in files if path and os.path.exists(path) and not os.access(path, os.R_OK | os.W_OK)]
    if closed:
        return f"no permission for {closed[0]}; its group, often render or video, has it ({failure})"
    known = next((words for code, words in _REASONS.items() if code in failure), None)
    return failure if known is None else f"{known} ({failure})"


def name_of(strings: Mapping[int, str]) -> str:
    """Return the name of a device that cannot be opened."""
    software = "software driver" if "EGL_MESA_device_software" in strings.get(EGL_EXTENSIONS, "") else ""
    names = [strings.get(each) for each in (EGL_RENDERER, EGL_DRIVER_NAME, EGL_DRM_DEVICE_FILE)]
    return next(filter(None, [*names, software]), "no name")


def reason_of(failure: str, number: int, strings: Mapping[int, str]) -> str:
    """Return in plain words why a device cannot be opened."""
    files = [strings.get(each, "") for each in (EGL_DRM_DEVICE_FILE, EGL_DRM_RENDER_NODE_FILE)]
    return in_words(failure.removeprefix(f"device {number}: "), files)


@dataclass(frozen=True)
class Machine:
    """Files, libraries and variables of a machine, on which it depends if its graphics cards draw."""

    files: Callable[[str], list[str]] = glob
    may_use: Callable[[str], bool] = lambda path: os.access(path, os.R_OK | os.W_OK)
    environment: Mapping[str, str] = field(default_factory=lambda: os.environ)

    def has(self, *patterns: str) -> bool:
        """True if there is a file of any of the patterns."""
        return any(self.files(pattern) for pattern in patterns)

    def loads(self, library: str) -> bool:
        """True if the system finds a shared library."""
        try:
            ctypes.CDLL(library)
        except OSError:
            return False
        return True


def hindrances(machine: Machine | None = None) -> list[str]:
    """Return what keeps graphics cards of this machine from being listed or opened, a line each."""
    machine = machine or Machine()
    closed = [path for path in sorted(machine.files(_RENDER_NODES)) if not machine.may_use(path)]
    found = [f"no permission for {closed[0]}; its group, often render or video, has it"] if closed else []
    if machine.has(*_NVIDIA_FILES):
        return [*found, *_hindrances_of_nvidia(machine)]
    if not machine.has(_DRM_FILES):
        found.append(
            "there is no /dev/dri: this machine has no graphics card, or its container was started without "
            "--device /dev/dri"
        )
    return found


def _hindrances_of_nvidia(machine: Machine) -> list[str]:
    found = []
    capabilities = machine.environment.get(_CAPABILITIES)
    if not machine.loads(_NVIDIA_LIBRARY):
        # The container toolkit mounts it for the capability "graphics" only.
        given = "" if capabilities is None else f", here {capabilities}"
        found.append(
            f"an NVIDIA card is here, but not its {_NVIDIA_LIBRARY}: a container has it if {_CAPABILITIES} names "
            f"graphics{given} (-e {_CAPABILITIES}=graphics,compute,utility)"
        )
    elif not machine.has(*_VENDOR_FILES):
        found.append(
            "an NVIDIA card is here, but EGL does not know its driver: the file "
            "/usr/share/glvnd/egl_vendor.d/10_nvidia.json is missing, as in many containers; it holds "
            '{"file_format_version": "1.0.0", "ICD": {"library_path": "libEGL_nvidia.so.0"}}'
        )
    is_part = any(machine.environment.get(name, "").startswith("MIG-") for name in _MIG_VARIABLES)
    if is_part or machine.has(*_MIG_FILES):
        found.append(
            "the NVIDIA card is divided by MIG: most cards offer their instances no graphics, only computing; a whole "
            "card, or an instance of a profile with +gfx, has it"
        )
    return found


def number_of(device: int | str) -> int | None:
    """Return the number of a device that is given by number; None for a name."""
    text = str(device).strip()
    return int(text) if not isinstance(device, bool) and text.isascii() and text.isdigit() else None


def chosen(device: int | str, devices: Sequence[Device], notes: Sequence[str] = ()) -> Device:
    """Return the device of that number, or the first usable one with that in its name.

    `notes` say why there may be fewer than expected.

    Raises
    ------
    InputError
        If there is none; the message lists what there is.
    ContextError
        If it cannot be used.
    """
    text, number = str(device).strip(), number_of(device)
    if isinstance(device, bool) or not text:
        found: list[Device] = []
    elif number is not None:
        found = [each for each in devices if each.number == number]
    else:
        found = [each for each in devices if text.lower() in each.name.lower()]
    if not found:
        listed = ", ".join(f"{each.number} ({each.name})" for each in devices) or "none"
        wanted = f"device must be the number or a part of the name of one, got {device!r}; there are: {listed}"
        raise InputError("; ".join([wanted, *notes]))
    usable = [each for each in found if each.reason is None]
    if not usable:
        raise ContextError(f"device {found[0].number} ({found[0].name}) cannot be used: {found[0].reason}")
    return usable[0]
