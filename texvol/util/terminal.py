"""Output of commands on stdout and stderr, and capture of what C libraries print."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import IO

from texvol.util.errors import InputError
from texvol.util.shown_text import one_line, shown

_LONGEST_REASON = 400  # characters of a library's message
_LONGEST_MESSAGE = 4000  # characters; enough to list all options of a scene


def say(text: str) -> None:
    """Print a command's result; unprintable characters become question marks, control characters their numbers."""
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
    if sys.stderr is not None:
        print(f"texvol: {one_line(text, _LONGEST_MESSAGE)}", file=sys.stderr, flush=True)


@contextmanager
def status_line() -> Iterator[Callable[[str], None]]:
    """Yield a function that shows a line on a terminal, in place of the one before; the line is erased at the end."""
    is_terminal = sys.stderr is not None and sys.stderr.isatty()
    text = ""

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


def library_reason(error: object) -> str:
    """Return the message of a library as one line of limited length."""
    return one_line(error, _LONGEST_REASON) or "no reason given"


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
