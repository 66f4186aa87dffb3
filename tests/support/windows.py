"""A display without a screen, a window on it, and what it left behind."""

from __future__ import annotations

import atexit
import contextlib
import csv
import ctypes
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import IO, Any

import numpy as np
import pytest

from texvol.__main__ import main
from texvol.formats.pictures import image

REPOSITORY = Path(__file__).parents[2]
PATIENCE = 180  # seconds; a window that hangs is a failure, a busy machine is not


_STARTED: list[subprocess.Popen[str]] = []


@pytest.fixture
def display() -> Iterator[str]:
    """Name of a display of 1280 x 1024 pixels; windows that a test has left on it are ended."""
    yield display_of_all()
    while _STARTED:
        process = _STARTED.pop()
        if process.poll() is None:
            process.kill()
            process.communicate()


@cache
def display_of_all() -> str:
    """The display, started when first wanted, for all tests of this process."""
    if not shutil.which("Xvfb"):
        pytest.skip("Xvfb is not installed (Debian, Ubuntu: xvfb)")
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x1024x24", "-nolisten", "tcp"],
        pass_fds=(write,),
        stderr=subprocess.DEVNULL,
        preexec_fn=_die_with_parent,
    )
    os.close(write)
    with os.fdopen(read) as numbers:
        number = numbers.readline().strip()
    assert number, "Xvfb has not started"
    atexit.register(_end, server)
    return f":{number}"


def _die_with_parent() -> None:
    """However the tests end, nothing that they have started stays."""
    pr_set_pdeathsig = 1  # linux/prctl.h
    ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGKILL)


def _end(server: subprocess.Popen[bytes]) -> None:
    server.terminate()
    try:
        server.wait(10)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()


# Beginnings of the names of variables for which a window needs processes of its own; libraries add others at any time.
_OF_PROCESSES = ("MALLOC_", "PYTHON", "GALLIUM_", "GALLIVM_", "MESA_", "LIBGL_", "LP_", "HOME", "PATH", "TEXVOL")


def environment(display: str | None, folder: Path) -> dict[str, str]:
    """Return the environment variables of a window; its user's files are in the folder."""
    kept = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    paths = os.pathsep.join([str(REPOSITORY), *filter(None, [os.environ.get("PYTHONPATH")])])
    shown = {"DISPLAY": display} if display else {}
    return kept | shown | {"PYTHONPATH": paths, "XDG_STATE_HOME": str(folder / "state")}


def started(display: str | None, folder: Path, *words: str) -> subprocess.Popen[str]:
    """`texvol view`, running in the folder."""
    process = subprocess.Popen(
        [sys.executable, "-m", "texvol", "view", *words],
        cwd=folder,
        env=environment(display, folder),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=_die_with_parent,
    )
    _STARTED.append(process)
    return process


def viewed(display: str | None, folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """`texvol view`, until it ends: in a process of its own, or in one that does so for many tests."""
    told = environment(display, folder)
    shared = _view_process()
    if shared.settings == _settings(told):
        return shared.view(told, folder, *words)
    process = started(display, folder, *words)
    try:
        out, err = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        out, err = process.communicate()
        raise AssertionError(f"the window did not end: {err}") from None
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)


def _settings(told: dict[str, str]) -> dict[str, str]:
    """Variables that processes look at when they begin, and not for each window."""
    return {name: value for name, value in told.items() if name.startswith(_OF_PROCESSES)}


class ViewProcess:
    """A process that opens windows, see `support.window_process`."""

    def __init__(self) -> None:
        told = environment(None, Path(tempfile.gettempdir()))
        self.settings = _settings(told)
        self._read, write = os.pipe()
        self._out, self._err = tempfile.TemporaryFile(), tempfile.TemporaryFile()  # noqa: SIM115 (closed by `close`)
        self._process = subprocess.Popen(
            [sys.executable, "-P", str(Path(__file__).with_name("window_process.py")), str(write)],
            env=told,
            stdin=subprocess.PIPE,
            stdout=self._out,
            stderr=self._err,
            pass_fds=(write,),
            text=True,
            preexec_fn=_die_with_parent,
        )
        os.close(write)
        atexit.register(self.close)

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def view(self, told: dict[str, str], folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
        """Open a window, and wait until it is closed; a process that dies of it has its own exit status."""
        for file in (self._out, self._err):
            os.ftruncate(file.fileno(), 0)
            os.lseek(file.fileno(), 0, os.SEEK_SET)  # of the process as well: it writes by the same description
        request = {"folder": str(folder), "environment": told, "words": words}
        assert self._process.stdin
        with contextlib.suppress(BrokenPipeError):  # it has died, which the status says
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
        ready, _, _ = select.select([self._read], [], [], PATIENCE)
        if not ready:
            self._process.kill()
        answer = os.read(self._read, 100) if ready else b""
        status = int(answer) if answer else self._process.wait(PATIENCE)
        out, err = (_text(file) for file in (self._out, self._err))
        assert ready, f"the window did not end: {err}"
        return subprocess.CompletedProcess(["texvol", "view", *words], status, out, err)

    def close(self) -> None:
        """End the process and its painters."""
        atexit.unregister(self.close)
        try:
            self._process.communicate(timeout=10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
        os.close(self._read)
        for file in (self._out, self._err):
            file.close()


def _text(file: IO[bytes]) -> str:
    """Return what has been written to a file, and leave the position at which others write where it is."""
    return os.pread(file.fileno(), 1 << 20, 0).decode()


_VIEW_PROCESSES: list[ViewProcess] = []


def _view_process() -> ViewProcess:
    """The process of all windows of this process, started when first wanted; another one if it has died."""
    while _VIEW_PROCESSES and not _VIEW_PROCESSES[0].alive:
        _VIEW_PROCESSES.pop().close()
    if not _VIEW_PROCESSES:
        _VIEW_PROCESSES.append(ViewProcess())
    return _VIEW_PROCESSES[0]


def texvol(folder: Path, *words: str) -> None:
    """Another command, in the folder and in this process, which has to succeed."""
    with contextlib.chdir(folder):
        assert main(words) == 0


def script(folder: Path, steps: Sequence[dict[str, Any]], name: str = "script.jsonl") -> str:
    """Name of a file with these steps."""
    (folder / name).write_text("".join(json.dumps(step) + "\n" for step in steps))
    return name


def timings(path: Path) -> list[dict[str, str]]:
    """Lines of the table of frame times."""
    with path.open() as file:
        return list(csv.DictReader(file))


def eight_bits(path: Path) -> np.ndarray:
    """Pixels of a PNG file, (height, width, 3) integers."""
    return image.eight_bits(image.read(path)).astype(int)


def until(reached: Callable[[], object]) -> None:
    """Wait for it, as long as a busy machine may take."""
    end = time.monotonic() + PATIENCE
    while not reached():
        assert time.monotonic() < end, "it never came to that"
        time.sleep(0.05)


def ball(folder: Path, samples: int = 48) -> str:
    """Name of a volume with a soft ball and a denser one in it."""
    z, y, x = np.mgrid[tuple(slice(-1, 1, samples * 1j) for _ in range(3))]
    values = 200 * np.exp(-4 * (x**2 + y**2 + z**2)) + 300 * np.exp(-60 * ((x - 0.3) ** 2 + y**2 + (z - 0.2) ** 2))
    np.save(folder / "ball.npy", values.astype(np.float32))
    return "ball.npy"


def memory_of_each(process: int) -> dict[int, int]:
    """Bytes that a process and those that it has started hold, by their numbers; what they share counts each time."""
    found = {}
    for each in [process, *children_of(process)]:
        try:
            for line in Path(f"/proc/{each}/status").read_text().splitlines():
                if line.startswith("RssAnon:"):
                    found[each] = int(line.split()[1]) * 1024
        except OSError:  # it has ended meanwhile
            continue
    return found


def memory_of(process: int) -> int:
    """Bytes that a process and those that it has started hold."""
    return sum(memory_of_each(process).values())


def children_of(process: int) -> list[int]:
    """Processes that a process has started."""
    try:
        return [int(each) for each in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    except OSError:
        return []
