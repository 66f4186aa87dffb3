"""Library calls in a child process, which may crash, hang or leak open files.

The process is a fork: it shares all that is loaded, costs a few milliseconds, and sends its results through a pipe.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, NoReturn

from texvol.formats.readers.samples import FileFault
from texvol.util.terminal import fault_of, library_reason

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

_PATIENCE = 5.0  # seconds
_MISSING = b"\0"  # first byte of a message that is the name of a library


class Child:
    """Child process that sends messages."""

    def __init__(self, pid: int, messages: Connection) -> None:
        self._pid, self._messages = pid, messages
        self._ended = ""

    def take(self, seconds: float) -> bytes:
        """Return the next message.

        Raises
        ------
        EOFError
            If the process ends before; the text is its signal or status.
        TimeoutError
            If the message does not begin within the time.
        """
        if not self._messages.poll(seconds):
            raise TimeoutError
        try:
            return self._messages.recv_bytes()
        except (EOFError, OSError):
            raise EOFError(self.end()) from None

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
def forked(work: Callable[[Connection], object]) -> Iterator[Child]:
    """Run `work` in a child process with the connection to send to; the process ends with the context."""
    from multiprocessing.connection import Pipe

    messages, theirs = Pipe(duplex=False)
    with messages:
        with theirs:
            pid = os.fork()
            if pid == 0:
                _work(work, theirs.fileno())
        child = Child(pid, messages)
        try:
            yield child
        finally:
            child.end()


def _work(work: Callable[[Connection], object], pipe: int) -> NoReturn:
    """Body of the child: run `work` and exit without cleaning up, whatever happens."""
    import faulthandler
    import fcntl
    import gc
    import resource
    from multiprocessing.connection import Connection

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
        work(Connection(pipe, readable=False))
    finally:
        os._exit(0)


def check_survived(attempt: Callable[[], object]) -> None:
    """Return if `attempt` returns in a child process.

    Raises
    ------
    FileFault
        If `attempt` raises, ends its process, or takes too long.
    ModuleNotFoundError
        If `attempt` needs a library that is not installed.
    """

    def work(output: Connection) -> None:
        try:
            attempt()
            output.send_bytes(b"")
        except FileFault as fault:
            output.send_bytes(library_reason(fault).encode())
        except ImportError as error:
            output.send_bytes(_MISSING + (error.name or str(error)).encode())
        except Exception as error:
            output.send_bytes(f"cannot be read: {fault_of(error)}".encode())

    with forked(work) as child:
        try:
            message = child.take(_PATIENCE)
        except TimeoutError:
            raise FileFault(f"is corrupt or too complex: it is not opened within {_PATIENCE:g} seconds") from None
        except EOFError as end:
            raise FileFault(f"is corrupt: reading it crashes the library ({end})") from None
    if message.startswith(_MISSING):
        library = message.removeprefix(_MISSING).decode().partition(".")[0]
        raise ModuleNotFoundError(f"No module named {library!r}", name=library)
    if message:
        raise FileFault(message.decode("utf-8", "replace"))
