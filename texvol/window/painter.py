"""Painter: the window's side of a painting process. It sends jobs, and receives answers on a thread."""

from __future__ import annotations

import contextlib
import itertools
import mmap
import os
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable
from functools import partial
from multiprocessing.connection import Connection, Pipe
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.util import writing
from texvol.util.errors import InputError
from texvol.util.package import environment_of_child
from texvol.window.jobs import Answer, Job
from texvol.window.transport import Sender, SharedArrays

_CLOSED = np.iinfo(np.int64).max
_PATIENCE = 5.0  # seconds to wait for the end of a killed process


class Painter:
    """Painting process.

    Parameters
    ----------
    shared : SharedArrays
        Shared memory of arrays that go to several processes.
    wake : callable
        Called on another thread after each answer.
    niceness : int
        Niceness of the process.
    device : int or str, optional
        Device that it draws on, as for `Renderer`.

    Raises
    ------
    InputError
        If the process can't be started.
    """

    def __init__(
        self,
        shared: SharedArrays,
        wake: Callable[[], None],
        niceness: int = 0,
        device: int | str | None = None,
    ) -> None:
        self._shared, self._wake, self._niceness, self._device = shared, wake, niceness, device
        self._numbers = itertools.count(1)
        self._answers: deque[Answer] = deque()
        self._waited_for: int | None = None  # number of the newest job, until its final answer
        self._begin()

    def _begin(self) -> None:
        file = os.memfd_create("texvol-newest")
        try:
            os.ftruncate(file, 8)
            self._newest = np.frombuffer(mmap.mmap(file, 8), np.int64)
            self._connection, theirs = Pipe()
            with theirs:
                self._process = _started(theirs.fileno(), file, self._niceness, self._device)
        except OSError as error:
            raise InputError(f"cannot start a painting process: {error.strerror or error}") from None
        finally:
            os.close(file)
        self._sender = Sender(self._connection, self._shared)
        listen = partial(self._listen, self._process, self._connection, self._newest)
        self._listener = threading.Thread(target=listen, daemon=True, name="texvol painter")
        self._listener.start()

    @property
    def busy(self) -> bool:
        """True until the newest job has its final answer."""
        return self._waited_for is not None

    @property
    def quiet(self) -> bool:
        """True if no answer waits to be taken."""
        return not self._answers

    @property
    def alive(self) -> bool:
        """True while the process runs."""
        return self._process.poll() is None

    @property
    def arrays(self) -> set[int]:
        """Identities of the arrays that the process needs."""
        return self._sender.arrays

    def ask(self, **job: Any) -> None:
        """Start a job, which supersedes the current one; a dead process is started again."""
        if not self.alive:  # for example killed because memory ran out
            self._connection.close()
            self._begin()
        number = self._newest[0] = self._waited_for = next(self._numbers)
        try:
            self._sender.send(Job(number, **job))
        except (BrokenPipeError, ConnectionError):
            self._answers.append(Answer("failed", number, text=_gone(self._process)))
        except OSError as error:  # no shared memory left for the arrays
            reason = writing.reason_of(error)
            self._answers.append(Answer("failed", number, text=f"cannot send the scene to be drawn: {reason}"))

    def drop(self) -> None:
        """Cancel the current job."""
        self._newest[0] = next(self._numbers)
        self._waited_for = None

    def answers(self) -> list[Answer]:
        """Return new answers to the newest job."""
        taken = []
        while self._answers:
            answer = self._answers.popleft()
            if answer.number == self._waited_for or answer.number == 0:
                taken.append(answer)
                if answer.final:
                    self._waited_for = None
        return taken

    def close(self) -> None:
        """End the process."""
        self._newest[0] = _CLOSED
        with contextlib.suppress(OSError):
            self._connection.close()
        self._process.kill()  # it has no files open that it writes
        with contextlib.suppress(subprocess.TimeoutExpired):  # a busy machine may take long to take its memory back
            self._process.wait(_PATIENCE)
        self._listener.join(_PATIENCE)

    def _listen(self, process: subprocess.Popen[bytes], connection: Connection, newest: NDArray[np.int64]) -> None:
        try:
            while True:
                self._answers.append(connection.recv())
                self._wake()
        except (EOFError, OSError, TypeError, ValueError):  # closed by `close`, or the process has ended
            if newest[0] not in (_CLOSED, 0):  # it had a job
                self._answers.append(Answer("failed", int(newest[0]), text=_gone(process)))
                with contextlib.suppress(Exception):
                    self._wake()


def _gone(process: subprocess.Popen[bytes]) -> str:
    # It ends: a job that comes before it has would be lost.
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(_PATIENCE)
    return f"the painting process ended unexpectedly (status {process.poll()})"


def _started(connection: int, newest: int, niceness: int, device: int | str | None) -> subprocess.Popen[bytes]:
    code = f"from texvol.window import painting; painting.serve({connection}, {newest}, {niceness}, {device!r})"
    return subprocess.Popen(
        [sys.executable, "-P", "-c", code],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        env=environment_of_child(),
        pass_fds=(connection, newest),
        process_group=0,  # Ctrl-C in the terminal is for the window only
    )
