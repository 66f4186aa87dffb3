"""Commands that are run on a terminal of their own, and interrupted."""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from support.windows import PATIENCE, REPOSITORY


def on_terminal(folder: Path, words: list[str], interrupt_when: Callable[[str], bool]) -> tuple[int, str, float]:
    """Run a command on a terminal; return its status, what it printed, and the seconds from ctrl-C to its end."""
    process, terminal = pty.fork()
    if process == 0:
        os.chdir(folder)
        os.execve(
            sys.executable, [sys.executable, "-m", "texvol", *words], os.environ | {"PYTHONPATH": str(REPOSITORY)}
        )
    printed, pressed, end = "", 0.0, time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if not select.select([terminal], [], [], 0.05)[0]:
            continue
        try:
            printed += os.read(terminal, 65536).decode(errors="replace")
        except OSError:  # the command has ended
            break
        if not pressed and interrupt_when(printed):
            os.write(terminal, b"\x03")
            pressed = time.monotonic()
    _, status = os.waitpid(process, 0)
    os.close(terminal)
    return os.waitstatus_to_exitcode(status), printed, time.monotonic() - pressed if pressed else 0.0


def shell_line(program: list[str], folder: Path, setup: str, keys: str) -> str:
    """Return the line that a shell on a terminal holds after keys; ctrl-X must print it between << and >>."""
    process, terminal = pty.fork()
    if process == 0:
        os.chdir(folder)
        os.execve(program[0], program, os.environ | {"TERM": "dumb", "HOME": str(folder), "PS1": "", "INPUTRC": "/no"})
    try:
        os.write(terminal, f"{setup}\necho rea''dy\n".encode())
        _read_until(terminal, r"\nready\r")
        os.write(terminal, keys.encode())
        os.write(terminal, b"\x18")
        found: str = _read_until(terminal, r"<<(.*?)>>").group(1)
        return found
    finally:
        os.close(terminal)
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)


def _read_until(terminal: int, pattern: str) -> re.Match[str]:
    printed, end = "", time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if select.select([terminal], [], [], 0.05)[0]:
            printed += os.read(terminal, 65536).decode(errors="replace")
            if found := re.search(pattern, printed, re.DOTALL):
                return found
    raise AssertionError(f"the shell must print {pattern}, got {printed!r}")


def rippled_ball(folder: Path, samples: int) -> str:
    """Write a ball with ripples, samples³ numbers of 16 bits, and return the file's name."""
    z, y, x = np.mgrid[tuple(slice(-1, 1, samples * 1j) for _ in range(3))].astype(np.float32)
    ball = 200 * np.exp(-4 * (x**2 + y**2 + z**2)) + 20 * np.sin(60 * x * y)
    np.save(folder / "ball.npy", ball.astype(np.int16))
    return "ball.npy"
