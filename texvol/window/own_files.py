"""Files that the window may overwrite: those that it has read as the scene or written, unless they have changed since.

A scene may overwrite those in which it was itself read or saved.

A file is known again by its number, size and time of change on the disk. Before any other file is overwritten, the user
is asked.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Collection, Iterable, Mapping
from itertools import count
from pathlib import Path
from typing import NamedTuple


class Mark(NamedTuple):
    """Marks by which an unchanged file is known again."""

    number: int
    size: int
    changed: int


def mark_of(path: str) -> Mark | None:
    """Return the marks of a file; None if there is none."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return Mark(found.st_ino, found.st_size, found.st_mtime_ns)


class OwnFiles:
    """Files that the window, or one of its scenes, has read as a scene or has written."""

    def __init__(self) -> None:
        self.known: dict[str, Mark | None] = {}

    def learn(self, marks: Mapping[str, Mark | None]) -> None:
        """Remember files by the marks that they had when they were read."""
        self.known.update({real(path): mark for path, mark in marks.items()})

    def wrote(self, paths: Iterable[str]) -> None:
        """Remember files that have just been written."""
        self.learn({path: mark_of(path) for path in paths})

    def foreign(self, path: str) -> str:
        """Return why a file must not be overwritten unasked, as part of a sentence; "" if it may be."""
        now, path = mark_of(path), real(path)
        if now is None or self.known.get(path) == now:
            return ""
        return "has been changed by another program" if path in self.known else "exists"


def real(path: str) -> str:
    """Return the path without links; the path itself where there can be no such file, which the writer will say."""
    try:
        return os.path.realpath(path)
    except (OSError, ValueError):
        return path


def marks_of_scene(path: str | None) -> dict[str, Mark | None]:
    """Return the marks of a scene file and of the transfer functions that it names."""
    if path is None:
        return {}
    marks = {path: mark_of(path)}
    try:
        content = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError):  # the reader of the scene says what is wrong with it
        return marks
    added = content.get("add")
    for table in [content, *(added if isinstance(added, list) else [])]:
        name = table.get("tf") if isinstance(table, dict) else None
        if isinstance(name, str) and name.endswith(".json"):
            beside = os.path.join(os.path.dirname(path), name)
            marks[beside] = mark_of(beside)
    return marks


def unused(path: str, files: Callable[[str], Iterable[str]], first: bool = False, taken: Collection[str] = ()) -> str:
    """Return a path of which no file exists, with a number before the suffix; with `first`, the path itself may do.

    Parameters
    ----------
    files : callable
        Returns the files that are written for a path.
    taken : collection of str
        Real paths of files that are still to be written.
    """

    def is_free(name: str) -> bool:
        return not any(os.path.lexists(each) or real(each) in taken for each in files(name))

    stem, suffix = os.path.splitext(path)
    names = ([path] if first else []), (f"{stem}-{number}{suffix}" for number in count(1))
    return next(each for several in names for each in several if is_free(each))


def written(path: str, views: int | None) -> list[str]:
    """Return the files of a picture, a film, or as many numbered pictures as `views` if the name has a number."""
    from texvol.formats.films import film as films

    if views is None or "%" not in os.path.basename(path):
        return [path]
    return [str(films.numbered(path, number)) for number in range(views)]
