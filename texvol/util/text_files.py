"""Text files that people write, TOML and JSON: read whole and parsed, and whatever is wrong becomes one InputError.

Only regular files of a bounded size are read: a pipe may never come, and a device may never end. What is parsed has
no nesting, number or text that the rest of the program could not take.
"""

from __future__ import annotations

import json
import os
import re
import stat
import sys
from collections.abc import Iterable
from itertools import chain
from typing import Any

from texvol.util.errors import InputError

MOST_TOML_BYTES = 1 << 20  # tomllib takes half a second for them
DEEPEST = 32  # lists and objects in each other; a scene has four
_LONGEST_KEY = 100
# tomllib takes time by the square of the parts of a key: a.b.c, of bare or quoted parts.
_LONG_KEY = re.compile(
    rf"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{_LONGEST_KEY}}}""", re.ASCII
)
_LARGEST = sys.float_info.max
_NO_CHARACTER = re.compile("[\0\ud800-\udfff]")


def check_name(path: str | os.PathLike[str]) -> None:
    """Raise InputError where no file can have that name: it has a NUL, or half of a surrogate pair."""
    try:
        if b"\0" in os.fsencode(path):
            raise InputError(f"{os.fspath(path)!r}: is no name of a file: it has a NUL")
    except UnicodeEncodeError as error:
        raise InputError(f"{os.fspath(path)!r}: is no name of a file: {error}") from None


def check_regular(path: str | os.PathLike[str]) -> int:
    """Bytes of the regular file at `path`, which may be a link to one.

    Raises
    ------
    InputError
        If there is none, or it is a folder, a pipe, a socket or a device.
    """
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
    """The text of a file.

    Parameters
    ----------
    kind : str
        What it holds, for messages: such as "TOML" or "JSON".
    most_bytes : int
        The longest that is taken.

    Raises
    ------
    InputError
        If it can't be read, is no regular file, is too long, or is not UTF-8.
    """
    size = check_regular(path)
    try:
        with open(path, "rb") as file:
            content = file.read(most_bytes + 1)  # which may have grown
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if len(content) > most_bytes:
        size = max(size, len(content))
        raise InputError(f"{path}: is too long: {size} bytes, and at most {most_bytes} are read")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not {kind}: it is not UTF-8 text") from None


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The content of a TOML file.

    Raises
    ------
    InputError
        If it can't be read, or is no TOML that can be used; see the module.
    """
    import tomllib

    text = read_text(path, "TOML", MOST_TOML_BYTES).replace("\r\n", "\n")
    if _LONG_KEY.search(text):
        raise InputError(f"{path}: is not TOML that texvol reads: a key has {_LONGEST_KEY} parts or more")
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{path}: is not TOML that texvol reads: {_too_deep()}") from None
    except ValueError as error:  # TOMLDecodeError, and what int() says of too many digits
        raise InputError(f"{path}: is not TOML: {_reason(error)}") from None
    _check_content(content, f"{path}: is not TOML that texvol reads")
    return content


def parsed_json(text: str, name: str) -> Any:
    """Return the content of a JSON text; `name` begins messages.

    Raises
    ------
    InputError
        If it is no JSON that can be used, see the module, or a key stands twice in an object.
    """
    try:
        content = json.loads(text, object_pairs_hook=_without_duplicates)
    except RecursionError:
        raise InputError(f"{name}: is not JSON that texvol reads: {_too_deep()}") from None
    except ValueError as error:
        raise InputError(f"{name}: is not JSON: {_reason(error)}") from None
    _check_content(content, f"{name}: is not JSON that texvol reads")
    return content


def _reason(error: ValueError) -> str:
    """The parser's reason; without advice on Python where it is a number of too many digits."""
    reason = str(error)
    return f"a number has more than {sys.get_int_max_str_digits()} digits" if "int_max_str" in reason else reason


def _too_deep() -> str:
    return f"lists and tables in each other, deeper than {DEEPEST}"


def _check_content(content: Any, fault: str) -> None:
    """Raise InputError where it is nested too deeply, or a text has what no file's name and no header can have."""
    level, depth = [content], 0
    while level:
        depth += 1
        if depth > DEEPEST + 1:  # beside numbers and texts, which are the innermost
            raise InputError(f"{fault}: {_too_deep()}")
        for each in level:
            if isinstance(each, int) and abs(each) > _LARGEST:
                raise InputError(f"{fault}: a number is too large")
            for text in each if isinstance(each, dict) else (each,):
                if isinstance(text, str) and _NO_CHARACTER.search(text):
                    raise InputError(f"{fault}: {text[:60]!r} has a NUL, or half of a surrogate pair")
        level = list(chain.from_iterable(_inner(each) for each in level if isinstance(each, dict | list)))


def _inner(thing: dict[str, Any] | list[Any]) -> Iterable[Any]:
    return thing.values() if isinstance(thing, dict) else thing


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) != len(pairs):
        raise ValueError("a key stands twice in one object")
    return content
