"""Fingerprint of a picture or measurement: driver, versions and processor, without which numbers can't be compared."""

from __future__ import annotations

import os
import platform
from functools import cache
from importlib import metadata

from texvol.util.version import __version__

NOT_SAID = "not said"
_LIBRARIES = ("moderngl", "numpy", "numba", "OpenImageIO")


def machine() -> dict[str, str]:
    """Return processor and Python version."""
    return {
        "Python": f"{platform.python_version()}, {platform.system()} {platform.machine()}",
        "processor": f"{_processor()}, {_cores()}",
    }


def versions(libraries: tuple[str, ...] = _LIBRARIES) -> dict[str, str]:
    """Return versions of texvol and of libraries."""
    return {"texvol": __version__, "libraries": ", ".join(f"{name} {_version(name)}" for name in libraries)}


def of_picture(driver: str | None) -> dict[str, str]:
    """Return the fingerprint of a picture made by this process; `driver` is the renderer's name, if known."""
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
