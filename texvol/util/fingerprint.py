"""What a picture was made with: driver, versions, processor. Pictures and numbers without it can't be compared."""

from __future__ import annotations

import os
import platform
from functools import cache
from importlib import metadata

from texvol.util.version import __version__

NOT_SAID = "not said"
_LIBRARIES = ("moderngl", "numpy", "numba", "OpenImageIO")


def machine() -> dict[str, str]:
    """Processor and Python, in words."""
    return {
        "Python": f"{platform.python_version()}, {platform.system()} {platform.machine()}",
        "processor": f"{_processor()}, {_cores()}",
    }


def versions(libraries: tuple[str, ...] = _LIBRARIES) -> dict[str, str]:
    """Versions of texvol and of libraries, in words."""
    return {"texvol": __version__, "libraries": ", ".join(f"{name} {_version(name)}" for name in libraries)}


def of_picture(driver: str | None) -> dict[str, str]:
    """The fingerprint of a picture that was made just now; `driver` is what drew it, where that is known."""
    return {"driver": driver or NOT_SAID, **versions(), **machine()}


@cache
def _version(library: str) -> str:
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return "not installed"


@cache
def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as lines:
            names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()


def _cores() -> str:
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return f"{usable} cores" if usable > 1 else "1 core"
