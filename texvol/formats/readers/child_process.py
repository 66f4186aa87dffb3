"""Library calls in a child process, which may crash, hang or leak open files.

The process is a fork: it shares all that is loaded, costs a few milliseconds, and sends its results through a pipe.
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
from texvol.util.terminal import library_reason

_PATIENCE = 5.0  # seconds
_MOST_READ = 2**20  # bytes at a time
_LONGEST = 2**12  # bytes of a message
_DONE = b"done"


class Died(Exception):
    """The process ended before it sent everything; the message is its signal or status."""


class Late(Exception):
    """The process exceeded its time."""


class Child:
    """Child process that writes into a pipe."""

    def __init__(self, pid: int, pipe: IO[bytes]) -> None:
        self._pid, self._pipe = pid, pipe
        self._ended = ""

    def take(self, size: int, seconds: float) -> bytearray:
        """Return the next `size` bytes of the pipe.

        Raises
        ------
        Died, Late
            If the process ends or takes too long.
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
        """End the process and return its signal or status in words."""
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
    """Run `work` in a child process with the pipe to write into; the process ends with the context."""
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
    """Body of the child: run `work` and exit without cleaning up, whatever happens."""
    import faulthandler
    import fcntl
    import gc
    import resource

    try:
        gc.disable()  # garbage here belongs to the parent, such as OpenGL objects
        faulthandler.disable()  # the parent reports crashes
        signal.set_wakeup_fd(-1)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE):
            signal.signal(number, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        pipe = fcntl.fcntl(pipe, fcntl.F_DUPFD, 3)  # its number is 2 if there was no stderr
        # Inherited pipes would stay open, and their readers would not see the end.
        os.closerange(3, pipe)
        os.closerange(pipe + 1, resource.getrlimit(resource.RLIMIT_NOFILE)[0])
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        with open(pipe, "wb", buffering=0) as output:
            work(output)
    finally:
        os._exit(0)


def check_survived(attempt: Callable[[], object]) -> None:
    """Return if `attempt` returns in a child process.

    Raises
    ------
    FileFault
        If `attempt` raises, ends its process, or takes too long.
    """

    def work(output: IO[bytes]) -> None:
        try:
            attempt()
            message = _DONE
        except Exception as error:
            message = f"cannot be read: {library_reason(error)}".encode()
        output.write(message[:_LONGEST].ljust(_LONGEST))

    with forked(work) as child:
        try:
            message = bytes(child.take(_LONGEST, _PATIENCE)).rstrip()
        except Late:
            raise FileFault(f"is corrupt or too complex: it is not opened within {_PATIENCE:g} seconds") from None
        except Died as died:
            raise FileFault(f"is corrupt: reading it crashes the library ({died})") from None
    if message != _DONE:
        raise FileFault(message.decode("utf-8", "replace"))
