"""Folders within which files are read and written for a user who is not at this machine; without a limit, all.

A window in a browser sets the limit. It is one for the process, and what reads or writes a file that a user may name
checks it: paths come from fields, from lists of recent files, from options and from scene files. A link counts as the
file that it leads to.
"""

from __future__ import annotations

import os
import posixpath
from collections.abc import Iterable
from urllib.parse import unquote, urlsplit

from texvol.util.errors import InputError
from texvol.util.locations import is_remote, public

_folders: tuple[str, ...] | None = None  # without links; URLs as they are
_own: tuple[str, ...] = ()


def limit(folders: Iterable[str] | None, own: Iterable[str] = ()) -> None:
    """Allow these folders, and what is in them, and nothing else; None allows everything.

    Parameters
    ----------
    own : iterable of str
        Folders of files that the program keeps for itself; they are allowed, and not offered to a user.
    """
    global _folders, _own
    _folders = None if folders is None else tuple(dict.fromkeys(_real(each) for each in folders))
    _own = tuple(_real(each) for each in own)


def folders() -> tuple[str, ...]:
    """Return the allowed folders of this machine; none without a limit."""
    return tuple(each for each in _folders or () if not is_remote(each))


def is_limited() -> bool:
    """True if a limit is set."""
    return _folders is not None


def holds(path: str | os.PathLike[str]) -> bool:
    """True if a file or a URL may be read, and written where it can be."""
    return _folders is None or any(_is_inside(_real(os.fspath(path)), each) for each in (*_folders, *_own))


def check(path: str | os.PathLike[str]) -> None:
    """Raise InputError if a file must not be read or written."""
    if not holds(path):
        allowed = ", ".join(map(public, _folders or ())) or "no folder"
        raise InputError(f"{public(path)}: is outside {allowed}; texvol view --files FOLDER allows another folder")


def check_tree(folder: str | os.PathLike[str]) -> None:
    """Raise InputError if a link in a folder, or below it, leads to a file that must not be read.

    Of files that are no links only the names are read: a store has up to millions.
    """
    if not is_limited():
        return
    check(folder)
    waiting, seen = [os.fspath(folder)], set()
    while waiting:
        real = os.path.realpath(waiting.pop())
        if real in seen or not os.path.isdir(real):
            continue
        seen.add(real)
        with os.scandir(real) as entries:
            for each in entries:
                is_link = each.is_symlink()
                if is_link:
                    check(each.path)
                if is_link or each.is_dir():
                    waiting.append(each.path)


def _real(path: str) -> str:
    try:
        return path if is_remote(path) else os.path.realpath(path)
    except ValueError:  # no file has a NUL in its name, which the reader will say
        return os.path.abspath(path)


def _is_inside(path: str, folder: str) -> bool:
    if is_remote(path) != is_remote(folder):
        return False
    if not is_remote(path):
        return os.path.commonpath([path, folder]) == folder
    one, other = urlsplit(path), urlsplit(folder)
    inside = (posixpath.normpath(unquote(each.path) or "/").rstrip("/") + "/" for each in (one, other))
    return one[:2] == other[:2] and next(inside).startswith(next(inside))
