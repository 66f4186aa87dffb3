"""Libraries called in a process of their own: one that may die, hang, or keep what it has opened.

The process is a fork: it has all that is loaded, costs a few milliseconds, and says what it found through a pipe.
"""

from __future__ import annotations

import os
import select
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import IO, NoReturn

from texvol.formats.readers.samples import FileFault
from texvol.util.terminal import one_line

_PATIENCE = 5.0  # seconds
_MOST_READ = 2**20  # bytes at a time
_LONGEST = 2**12  # bytes of a message
_DONE = b"done"


class Died(Exception):
    """The process ended before it had said all, by this signal or status."""


class Late(Exception):
    """The process takes longer than it may."""


class Child:
    """A process that writes into a pipe."""

    def __init__(self, pid: int, pipe: IO[bytes]) -> None:
        self._pid, self._pipe = pid, pipe
        self._ended = ""

    def take(self, size: int, seconds: float) -> bytearray:
        """The next `size` bytes out of the pipe.

        Raises
        ------
        Died, Late
            If they do not come.
        """
        content = bytearray(size)
        view, at, until = memoryview(content), 0, time.monotonic() + seconds
        while at < size:
            if not select.select([self._pipe], [], [], max(until - time.monotonic(), 0))[0]:
                raise Late
            count = self._pipe.readinto(view[at : at + _MOST_READ])  # type: ignore[attr-defined]
            if not count:
                raise Died(self.end())
            at += count
        return content

    def end(self) -> str:
        """End the process, and say by what it has ended."""
        if not self._ended:
            self._ended = "status unknown"
            with suppress(ProcessLookupError, ChildProcessError):
                os.kill(self._pid, signal.SIGKILL)
                _, status = os.waitpid(self._pid, 0)
                code = os.waitstatus_to_exitcode(status)
                self._ended = f"signal {signal.Signals(-code).name}" if code < 0 else f"status {code}"
        return self._ended


@contextmanager
def forked(work: Callable[[IO[bytes]], object]) -> Iterator[Child]:
    """A process that does `work` with the pipe to be written into; it is over when the context is left."""
    output, input_ = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(output)
        _work(work, input_)
    os.close(input_)
    with open(output, "rb", buffering=0) as pipe:
        child = Child(pid, pipe)
        try:
            yield child
        finally:
            child.end()


def _work(work: Callable[[IO[bytes]], object], pipe: int) -> NoReturn:
    """The child: end without a trace, whatever happens."""
    import faulthandler
    import fcntl
    import gc
    import resource

    try:
        gc.disable()  # what is garbage here is the parent's, such as objects of OpenGL
        faulthandler.disable()  # the parent says what happened
        signal.set_wakeup_fd(-1)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE):
            signal.signal(number, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        pipe = fcntl.fcntl(pipe, fcntl.F_DUPFD, 3)  # it is 2 where there was no stderr
        # Another one's pipe would stay open with this process, and its end unseen.
        os.closerange(3, pipe)
        os.closerange(pipe + 1, resource.getrlimit(resource.RLIMIT_NOFILE)[0])
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        with open(pipe, "wb", buffering=0) as output:
            work(output)
    finally:
        os._exit(0)


def check_survived(attempt: Callable[[], object]) -> None:
    """Return if `attempt` returns in a process of its own.

    Raises
    ------
    FileFault
        If it raises something, ends its process, or does not come back.
    """

    def work(output: IO[bytes]) -> None:
        try:
            attempt()
            message = _DONE
        except Exception as error:
            message = f"cannot be read: {one_line(error)}".encode()
        output.write(message[:_LONGEST].ljust(_LONGEST))

    with forked(work) as child:
        try:
            message = bytes(child.take(_LONGEST, _PATIENCE)).rstrip()
        except Late:
            raise FileFault(f"is corrupt, or too much: it is not opened within {_PATIENCE:g} seconds") from None
        except Died as died:
            raise FileFault(f"is corrupt: reading it ends the process ({died})") from None
    if message != _DONE:
        raise FileFault(message.decode("utf-8", "replace"))
