"""What was measured on: driver, libraries, processor. Numbers without it can't be compared."""

from __future__ import annotations

import os
import platform
from importlib import metadata

from texvol import __version__
from texvol.contexts import open_context
from texvol.renderer import Renderer

_LIBRARIES = ("moderngl", "numpy", "numba", "OpenImageIO", "vtk", "matplotlib")


def fingerprint(renderer: Renderer) -> dict[str, str]:
    """Names and versions, in words."""
    context = open_context(renderer.backend)
    try:
        with context.current():
            info = context.gl.info
            vendor, version = info["GL_VENDOR"], info["GL_VERSION"]
    finally:
        context.release()
    return {
        "GL_RENDERER": renderer.renderer_name,
        "GL_VERSION": version,
        "GL_VENDOR": vendor,
        "context": renderer.backend,
        "texvol": __version__,
        "libraries": ", ".join(f"{name} {_version(name)}" for name in _LIBRARIES),
        "Python": f"{platform.python_version()}, {platform.system()} {platform.machine()}",
        "processor": f"{_processor()}, {_cores()}",
        "load before": f"{os.getloadavg()[0]:.1f} processes running, on average over a minute",
    }


def _version(library: str) -> str:
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return "not installed"


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
