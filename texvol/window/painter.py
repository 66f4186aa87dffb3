"""A painter: a process that draws, seen from the window. Jobs go there, answers come back on a thread of their own."""

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
from texvol.window.parcels import Sender, Shared

_CLOSED = np.iinfo(np.int64).max
_PATIENCE = 2.0  # seconds for a process to end by itself; it has nothing to write


class Painter:
    """One painting process.

    Parameters
    ----------
    shared : Shared
        Memory of arrays that go to several processes.
    wake : callable
        Called, on another thread, whenever an answer has come.
    niceness : int
        How far it stands back for others.
    """

    def __init__(self, shared: Shared, wake: Callable[[], None], niceness: int = 0) -> None:
        self._shared, self._wake, self._niceness = shared, wake, niceness
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
                self._process = _started(theirs.fileno(), file, self._niceness)
        except OSError as error:
            raise InputError(f"no process can be started to draw: {error.strerror or error}") from None
        finally:
            os.close(file)
        self._sender = Sender(self._connection, self._shared)
        listen = partial(self._listen, self._connection, self._newest)
        self._listener = threading.Thread(target=listen, daemon=True, name="texvol painter")
        self._listener.start()

    @property
    def busy(self) -> bool:
        """Whether the newest job has no final answer yet."""
        return self._waited_for is not None

    @property
    def alive(self) -> bool:
        """Whether the process is there."""
        return self._process.poll() is None

    @property
    def arrays(self) -> set[int]:
        """Identities of the arrays that it needs."""
        return self._sender.arrays

    def ask(self, **job: Any) -> int:
        """Have this drawn, whatever else is being drawn there; its number."""
        if not self.alive:  # the system may have wanted its memory
            self._connection.close()
            self._begin()
        number = next(self._numbers)
        self._newest[0] = number
        self._waited_for = number
        try:
            self._sender.send(Job(number, **job))
        except (BrokenPipeError, ConnectionError):
            self._answers.append(Answer("failed", number, text=self._gone()))
        except OSError as error:  # no room for the arrays that the other process is to share
            reason = writing.reason_of(error)
            self._answers.append(Answer("failed", number, text=f"the scene cannot be handed on: {reason}"))
        return number

    def drop(self) -> None:
        """Nothing is wanted any more."""
        self._newest[0] = next(self._numbers)
        self._waited_for = None

    def answers(self) -> list[Answer]:
        """What has come of the newest job."""
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
        self._process.kill()  # it holds nothing but memory
        self._process.wait(_PATIENCE)
        self._listener.join(_PATIENCE)

    def _listen(self, connection: Connection, newest: NDArray[np.int64]) -> None:
        try:
            while True:
                self._answers.append(connection.recv())
                self._wake()
        except (EOFError, OSError, TypeError, ValueError):  # closed here, or gone there
            if newest[0] != _CLOSED:
                self._answers.append(Answer("failed", int(newest[0]), text=self._gone()))
                with contextlib.suppress(Exception):
                    self._wake()

    def _gone(self) -> str:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(0.1)
        return f"the process that draws ended unexpectedly (status {self._process.poll()})"


def _started(connection: int, newest: int, niceness: int) -> subprocess.Popen:
    code = f"from texvol.window import painting; painting.serve({connection}, {newest}, {niceness})"
    return subprocess.Popen(
        [sys.executable, "-P", "-c", code],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        env=environment_of_child(),
        pass_fds=(connection, newest),
        process_group=0,  # ctrl-C is for the window
    )
