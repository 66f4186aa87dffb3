"""What commands print, and what libraries are kept from printing."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

from texvol.util import shown_text
from texvol.util.errors import InputError
from texvol.util.shown_text import shown

_LONGEST_LINE = 400  # of a library
_LONGEST_MESSAGE = 4000  # names the options of a scene, or all that is wrong with one


def say(text: str) -> None:
    """Print what was asked for; what the terminal cannot show becomes a question mark, what it would obey a number."""
    if sys.stdout is None:
        raise InputError("there is no standard output to write to")
    try:
        sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
        print(shown(text), flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        sys.stdout = None  # what it still holds can't be written at exit either
        raise InputError(f"standard output cannot be written to: {error.strerror}") from None


def complain(text: object) -> None:
    """Print one line on stderr, of a length that a terminal can take."""
    if sys.stderr is not None:
        print(f"texvol: {_shortened(shown_text.one_line(text), _LONGEST_MESSAGE)}", file=sys.stderr, flush=True)


def one_line(reason: object) -> str:
    """What a library says on one line, of a length that a terminal can take."""
    return _shortened(shown_text.one_line(reason) or "no reason given", _LONGEST_LINE)


def _shortened(line: str, longest: int) -> str:
    return line if len(line) <= longest else line[:longest] + " …"


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
