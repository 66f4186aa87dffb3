"""A first context in a process of its own, where the environment asks the driver for something unusual.

Mesa does what its variables say without a check: a driver that does not exist, a language version or an extension that
is needed, and making a context ends the process (SIGSEGV), where no Python can help. A process that may die finds out.

Not for every first context: a fork and a context in it take 37 ms at least with llvmpipe and hundreds with a graphics
card, beside some 130 ms for a small picture; and with a driver that is left alone there is nothing to find out. The
process is a new one, not a fork, which would have neither the other threads nor a right to what GL the program holds.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress

from texvol.util.errors import ContextError
from texvol.util.package import environment_of_child

# Begin the names of what Mesa and the libraries that find drivers read.
_PREFIXES = (
    *("GALLIUM_", "GALLIVM_", "MESA_", "LIBGL_", "LP_", "ST_", "DRI_", "EGL_", "GLX_", "__EGL_", "__GL_", "__GLX_"),
    *("force_", "allow_", "disable_", "override_"),  # options of drirc, which are variables too
)
# None of these chooses a driver, or what it can do.
_HARMLESS = (
    *("EGL_LOG_LEVEL", "LIBGL_ALWAYS_SOFTWARE", "LIBGL_DEBUG", "MESA_DEBUG", "MESA_LOG_FILE", "DRI_PRIME"),
    *("GALLIVM_PERF", "LP_NUM_THREADS"),  # how shaders are compiled, and threads that draw
)
_HARMLESS_PREFIXES = ("MESA_SHADER_CACHE_", "MESA_GLSL_CACHE_", "MESA_DISK_CACHE_", "__GL_SHADER_DISK_CACHE")
_PATIENCE = 30.0  # seconds
_LONGEST = 40  # characters of a value in a message


def unusual(environment: Mapping[str, str] = os.environ) -> list[str]:
    """Settings of the driver that are found, as NAME=VALUE or the name of a file."""
    found = [
        f"{name}={value if len(value) <= _LONGEST else value[:_LONGEST] + '…'}"
        for name, value in environment.items()
        if name.startswith(_PREFIXES) and name not in _HARMLESS and not name.startswith(_HARMLESS_PREFIXES)
    ]
    home = environment.get("HOME")
    return found + ([f"{home}/.drirc"] if home and os.path.exists(f"{home}/.drirc") else [])


def check(backend: str) -> None:
    """Raise ContextError if a process that makes a context dies of it; nothing is done where nothing is unusual."""
    asked = unusual()
    if not asked or not sys.executable:
        return
    with suppress(OSError):  # no process can be started: then nobody knows
        try:
            apart(f"from texvol.opengl import contexts; contexts.attempt({backend!r})")
        except ContextError as error:
            raise ContextError(f"{error}, asked for {', '.join(asked)}") from None


def apart(code: str) -> subprocess.CompletedProcess[bytes]:
    """Run Python code that makes contexts in a process of its own.

    Raises
    ------
    ContextError
        If the process dies of the driver, or has no end.
    OSError
        If no process can be started.
    """
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", code],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment_of_child(),
            timeout=_PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ContextError("the driver does not answer") from None
    if done.returncode < 0:
        raise ContextError(f"the driver ends the process ({signal.Signals(-done.returncode).name})")
    return done
