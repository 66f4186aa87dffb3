"""Answers of the process in which a device is tried, see `listing`."""

from __future__ import annotations

import json
from typing import Any

from texvol.opengl import contexts
from texvol.opengl.contexts.egl import Egl
from texvol.opengl.contexts.listing import FAILURE
from texvol.util.errors import ContextError


def tell(what: str, number: int | None = None) -> None:
    """Print as JSON, in a process of its own, what `answer` returns."""
    print(json.dumps(answer(what, number)), flush=True)


def answer(what: str, number: int | None = None) -> dict[str, Any]:
    """Return which devices are "listed", or what one of "egl" or "osmesa" can do, or the failure."""
    try:
        return {"strings": _strings()} if what == "listed" else described(what, number)
    except ContextError as error:
        return {FAILURE: str(error)}


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
                "works": _abilities(context),
            }
    finally:
        context.release()


def _abilities(context: contexts.Context) -> list[str]:
    """Return what a device can do beside drawing, and how exactly it interpolates; `context` is current."""
    from texvol.opengl.filtering import bits_of, weights_error
    from texvol.opengl.pipelines import has_compute

    compute = "compute shaders" if has_compute(context) else "no compute shaders"
    return [compute, f"weights of {bits_of(weights_error(context))} bits"]
