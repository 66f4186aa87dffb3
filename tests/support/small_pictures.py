"""Small pictures on bare contexts, for the tests of contexts; also imported by processes that the tests start."""

from __future__ import annotations

import gc
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from texvol.opengl.contexts import Context, egl, native, open_context, osmesa
from texvol.util.errors import ContextError

BACKENDS = "egl", "osmesa"
SIZE = 32
REPOSITORY = Path(__file__).parents[2]

# Composites wavy colours ten times, so that every digit of exp, sin and the blend shows.
VERTEX = "#version 330\nin vec2 corner; void main() { gl_Position = vec4(corner, 0, 1); }"
FRAGMENT = """#version 330
uniform float phase;
out vec4 color;
void main() {
    vec2 p = gl_FragCoord.xy * 0.37 + phase;
    float opacity = 1.0 - exp(-0.1 - 0.05 * sin(p.x * p.y));
    color = vec4(opacity * abs(cos(vec3(p, p.x + p.y))), opacity);
}"""


def draw(context: Context, phase: float = 0.0) -> NDArray[np.float32]:
    """A picture (SIZE, SIZE, 4) that depends on `phase`; frees what it makes."""
    with context:
        gl = context.gl
        program = gl.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        corners = gl.buffer(np.array([-1, -1, 3, -1, -1, 3], "f4"))
        array = gl.vertex_array(program, [(corners, "2f", "corner")])
        texture = gl.texture((SIZE, SIZE), 4, dtype="f4")
        target = gl.framebuffer([texture])
        target.use()
        target.clear()
        gl.enable_only(gl.BLEND)
        gl.blend_func = gl.ONE_MINUS_DST_ALPHA, gl.ONE
        for layer in range(10):
            program["phase"] = phase + layer
            array.render()
        picture = np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(SIZE, SIZE, 4)
        assert gl.error == "GL_NO_ERROR"
        gl.screen.use()  # moderngl binds again what was bound last, which must not be a framebuffer that is gone
        for each in (target, texture, array, corners, program):
            each.release()
    return picture


def current() -> list[bool]:
    """Whether a context of EGL, and one of OSMesa, is current on this thread."""
    found = []
    for name in BACKENDS:
        library = native.loaded.get(name)
        if isinstance(library, egl.Egl):
            library.functions.eglBindAPI(egl.EGL_OPENGL_API)
            found.append(bool(library.functions.eglGetCurrentContext()))
        elif isinstance(library, osmesa.OSMesa):
            found.append(bool(getattr(library.current, "handle", None)))
        else:
            found.append(False)
    return found


def run_python(code: str, timeout: float = 120, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run Python in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (REPOSITORY, REPOSITORY / "tests"))), **environment},
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )


@cache
def opens(name: str) -> bool:
    """Whether the machine has the back end."""
    try:
        open_context(name).release()
    except ContextError:
        return False
    return True


def available() -> tuple[str, ...]:
    """Back ends that the machine has."""
    return tuple(filter(opens, BACKENDS))


def backend_or_skip(name: str) -> str:
    """The name, if the machine has the back end."""
    if not opens(name):
        pytest.skip(f"{name} does not open on this machine")
    return name


def own_kibibytes() -> int:
    """Memory that this process has asked for and written to, in RAM or swapped out.

    Pages of the libraries' files are left out: a system short of memory drops them and reads them again.
    """
    status = Path("/proc/self/status").read_text()
    in_ram, swapped = re.findall(r"^(?:RssAnon|VmSwap):\s+(\d+) kB$", status, re.MULTILINE)
    return int(in_ram) + int(swapped)


def memory_growth(name: str, *, warm: int = 24, times: int = 5, cycles: int = 16) -> float:
    """KiB that opening, drawing and closing a context adds, once everything is loaded.

    The median of a few times some cycles: LLVM and malloc take memory in steps, now and then, and a leak each time.
    """
    taken = []
    for cycle in range(warm + times * cycles + 1):
        if cycle >= warm and (cycle - warm) % cycles == 0:
            gc.collect()
            taken.append(own_kibibytes())
        context = open_context(name)
        draw(context)
        context.release()
    return float(np.median(np.diff(taken))) / cycles
