"""What was measured on: driver, libraries, processor. Numbers without it can't be compared."""

from __future__ import annotations

import os

from texvol.opengl.contexts import open_context
from texvol.rendering.renderer import Renderer
from texvol.util.fingerprint import machine, versions

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
        **versions(_LIBRARIES),
        **machine(),
        "load before": f"{os.getloadavg()[0]:.1f} processes running, on average over a minute",
    }
