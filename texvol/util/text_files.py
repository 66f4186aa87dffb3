"""Text files written by people (TOML, JSON), read whole and parsed; every fault becomes one InputError.

Only regular files of bounded size are read: reading a pipe may block, and a device may not end. The parsed content has
no nesting, number or text that the rest of the program cannot handle.
"""

from __future__ import annotations

import json
import os
import re
import stat
import sys
from collections.abc import Callable
from itertools import chain
from typing import Any

from texvol.util import reach
from texvol.util.errors import InputError

MOST_TOML_BYTES = 1 << 20  # tomllib parses them in half a second
DEEPEST = 32  # nested lists and objects; a scene has four
_TOO_DEEP = f"lists and tables nested deeper than {DEEPEST}"
_LONGEST_KEY = 100
# tomllib's time grows with the square of the number of parts of a key a.b.c, bare or quoted.
_LONG_KEY = re.compile(
    rf"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{_LONGEST_KEY}}}""", re.ASCII
)
_LARGEST = sys.float_info.max
_NO_CHARACTER = re.compile("[\0\ud800-\udfff]")


def check_name(path: str | os.PathLike[str]) -> None:
    """Raise InputError if no file can have that name: it has a NUL, or half of a surrogate pair."""
    try:
        if b"\0" in os.fsencode(path):
            raise InputError(f"{os.fspath(path)!r}: not a valid file name: it has a NUL")
    except UnicodeEncodeError as error:
        raise InputError(f"{os.fspath(path)!r}: not a valid file name: {error}") from None


def check_regular(path: str | os.PathLike[str]) -> int:
    """Return the number of bytes of the file at `path`, links followed; InputError if it is no regular file."""
    check_name(path)
    try:
        about = os.stat(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if stat.S_ISDIR(about.st_mode):
        raise InputError(f"{path}: is a folder")
    if not stat.S_ISREG(about.st_mode):
        raise InputError(f"{path}: is not a regular file")
    return about.st_size


def read_text(path: str | os.PathLike[str], kind: str, most_bytes: int) -> str:
    """Return the text of a file.

    Parameters
    ----------
    kind : str
        Name of the content for messages, such as "TOML".
    most_bytes : int
        Maximum size.

    Raises
    ------
    InputError
        If the file can't be read, is not a regular file, is too long, or is not UTF-8.
    """
    reach.check(path)
    size = check_regular(path)
    try:
        with open(path, "rb") as file:
            content = file.read(most_bytes + 1)  # the file may have grown
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if len(content) > most_bytes:
        size = max(size, len(content))
        raise InputError(f"{path}: is too long: must have at most {most_bytes} bytes, got {size}")
    try:
        return content.decode("utf-8-sig")  # without the byte order mark that some editors write
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not {kind}: it is not UTF-8 text") from None


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the content of a TOML file; InputError if it can't be read or is not usable, see the module."""
    import tomllib

    text = read_text(path, "TOML", MOST_TOML_BYTES).replace("\r\n", "\n")
    if _LONG_KEY.search(text):
        raise InputError(f"{path}: is TOML with a key of {_LONGEST_KEY} parts or more")
    content: dict[str, Any] = _parsed(tomllib.loads, text, f"{path}", "TOML")
    return content


def parsed_json(text: str, name: str) -> Any:
    """Return the content of a JSON text; `name` is its name in messages.

    Raises
    ------
    InputError
        If the text is not usable JSON (see the module), or an object has the same key twice.
    """
    return _parsed(lambda text: json.loads(text, object_pairs_hook=_without_duplicates), text, name, "JSON")


def _parsed(parse: Callable[[str], Any], text: str, name: str, kind: str) -> Any:
    try:
        content = parse(text)
    except RecursionError:
        raise InputError(f"{name}: is {kind} with {_TOO_DEEP}") from None
    except ValueError as error:  # also what int() says of too many digits
        raise InputError(f"{name}: is not {kind}: {_reason(error)}") from None
    _check_content(content, f"{name}: is {kind} with")
    return content


def _reason(error: ValueError) -> str:
    """Return the parser's reason, without its advice on Python for numbers of too many digits."""
    reason = str(error)
    return f"a number has more than {sys.get_int_max_str_digits()} digits" if "int_max_str" in reason else reason


def _check_content(content: Any, fault: str) -> None:
    """Raise InputError if the content is nested too deeply, or has a number or text that nothing else can hold."""
    level, depth = [content], 0
    while level:
        depth += 1
        if depth > DEEPEST + 1:  # the innermost level holds numbers and texts
            raise InputError(f"{fault} {_TOO_DEEP}")
        for each in level:
            if isinstance(each, int) and abs(each) > _LARGEST:
                raise InputError(f"{fault} a number that is too large")
            for text in each if isinstance(each, dict) else (each,):
                if isinstance(text, str) and _NO_CHARACTER.search(text):
                    raise InputError(f"{fault} a text with a NUL or half of a surrogate pair: {text[:60]!r}")
        inner = (each.values() if isinstance(each, dict) else each for each in level if isinstance(each, dict | list))
        level = list(chain.from_iterable(inner))


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) != len(pairs):
        raise ValueError("an object has the same key twice")
    return content
