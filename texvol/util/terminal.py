"""Output of commands on stdout and stderr, and capture of what C libraries print."""

from __future__ import annotations

import os
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import IO

from texvol.util.errors import InputError
from texvol.util.shown_text import one_line, shown

_LONGEST_REASON = 400  # characters of a library's message
_PATIENCE, _EVERY = 2.0, 0.25  # seconds until a line of progress is shown, and between two of them
_WIDTH = 78  # columns of that line
_LONGEST_MESSAGE = 4000  # characters; enough to list all options of a scene


def say(text: str) -> None:
    """Print a command's result; unprintable characters become question marks, control characters their numbers."""
    if _progress is not None:
        _progress.erase()
    if sys.stdout is None:
        raise InputError("standard output is closed")
    try:
        sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
        print(shown(text), flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        sys.stdout = None  # its buffer can't be written at exit either
        raise InputError(f"standard output: cannot be written: {error.strerror}") from None


def complain(text: object) -> None:
    """Print one line of limited length on stderr."""
    if _progress is not None:
        _progress.erase()
    if sys.stderr is not None:
        print(f"texvol: {one_line(text, _LONGEST_MESSAGE)}", file=sys.stderr, flush=True)


class _Progress:
    """Line on a terminal with what a command does and since when, once that has taken a while."""

    def __init__(self) -> None:
        self.stage = "working"
        self.fraction = 0.0  # of the stage that is done, if it is known
        self.is_shown = self.has_other = False  # True while the line, or one of `status_line`, is on the terminal
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._start = time.monotonic()

    def erase(self) -> None:
        """Erase the line, so that something else can be printed."""
        with self._lock:
            if self.is_shown and sys.stderr is not None:
                print(f"\r{' ' * _WIDTH}\r", end="", file=sys.stderr, flush=True)
            self.is_shown = False

    def run(self) -> None:
        """Show the line again and again until `end`."""
        while not self._ended.wait(_EVERY):
            seconds = time.monotonic() - self._start
            if seconds < _PATIENCE or self.has_other:
                continue
            with self._lock:
                if not self._ended.is_set():
                    done = f" {100 * self.fraction:.0f} %" if self.fraction > 0 else ""
                    text = one_line(f"texvol: {self.stage}{done}, {seconds:.0f} s", _WIDTH)
                    print(f"\r{text.ljust(_WIDTH)}", end="", file=sys.stderr, flush=True)
                    self.is_shown = True

    def end(self) -> None:
        """End and erase the line."""
        self._ended.set()
        self.erase()


_progress: _Progress | None = None


def shows_progress() -> bool:
    """True if a line of progress is shown on a terminal once the command takes longer than two seconds."""
    return _progress is not None


@contextmanager
def showing_progress() -> Iterator[None]:
    """Show on a terminal what is done, and for how long, as soon as it takes longer than two seconds."""
    global _progress
    if sys.stderr is None or not sys.stderr.isatty():
        yield
        return
    _progress = _Progress()
    thread = threading.Thread(target=_progress.run, daemon=True)
    thread.start()
    try:
        yield
    finally:
        _progress.end()
        _progress = None
        thread.join()


def stage(text: str) -> None:
    """Name what the command does from now on, for the line of progress."""
    if _progress is not None:
        _progress.stage, _progress.fraction = text, 0.0


def done(fraction: float) -> None:
    """Tell how much of the stage is done, for the line of progress."""
    if _progress is not None:
        _progress.fraction = fraction


@contextmanager
def status_line() -> Iterator[Callable[[str], None]]:
    """Yield a function that shows a line on a terminal, in place of the one before; the line is erased at the end."""
    is_terminal = sys.stderr is not None and sys.stderr.isatty()
    text = ""
    progress = _progress
    if progress is not None:
        progress.erase()
        progress.has_other = True

    def show(now: str) -> None:
        nonlocal text
        if is_terminal and now != text:
            print(f"\r{now.ljust(len(text))}", end="", file=sys.stderr, flush=True)
            text = now

    try:
        yield show
    finally:
        if text:
            print(f"\r{' ' * len(text)}\r", end="", file=sys.stderr, flush=True)
        if progress is not None:
            progress.has_other = False


# Exceptions of a library that stumbled over what it read, and does not say so.
_STUMBLES = (LookupError, TypeError, AttributeError, AssertionError, ArithmeticError, struct.error)


def library_reason(error: object) -> str:
    """Return the message of a library as one line of limited length."""
    return one_line(error, _LONGEST_REASON) or "no reason given"


def fault_of(error: Exception) -> str:
    """Return the message of a library's exception; one that was not meant for a reader is introduced."""
    message = library_reason(error)
    if isinstance(error, _STUMBLES):
        return f"it is damaged, or not as its library expects ({type(error).__name__}: {message})"
    return message if str(error) else type(error).__name__


@contextmanager
def held_back_stderr() -> Iterator[IO[bytes]]:
    """Redirect stderr, also of C libraries, to the temporary file that this context yields."""
    import tempfile

    with tempfile.TemporaryFile() as printed:
        try:
            stderr = os.dup(2)
        except OSError:  # there is none
            yield printed
            return
        os.dup2(printed.fileno(), 2)
        try:
            yield printed
        finally:
            os.dup2(stderr, 2)
            os.close(stderr)
