"""What commands print, and what libraries are kept from printing."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

from texvol.errors import InputError

_LONGEST_LINE = 400


def say(text: str) -> None:
    """Print what was asked for; what the terminal cannot show becomes a question mark."""
    if sys.stdout is None:
        raise InputError("there is no standard output to write to")
    try:
        sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
        print(text, flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        sys.stdout = None  # what it still holds can't be written at exit either
        raise InputError(f"standard output cannot be written to: {error.strerror}") from None


def one_line(reason: object) -> str:
    """What a library says on one line, of a length that a terminal can take."""
    line = " ".join(str(reason).split()) or "no reason given"
    return line if len(line) <= _LONGEST_LINE else line[:_LONGEST_LINE] + " …"


@contextmanager
def held_back_stderr() -> Iterator[IO[bytes]]:
    """A file that takes what C libraries print on stderr."""
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
