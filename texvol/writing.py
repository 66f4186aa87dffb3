"""Files written whole or not at all: beside their place first, then renamed."""

from __future__ import annotations

import contextlib
import itertools
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from texvol.errors import InputError

_numbers = itertools.count()


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise InputError if no file can be written to `path`: asked before the work of making one."""
    path = Path(path)
    folder = path.parent
    try:
        if path.is_dir() or not path.name:
            raise InputError(f"{path}: is a folder, and a file is to be written")
        if not folder.is_dir():
            raise InputError(f"{path}: its folder {folder} does not exist")
        if path.exists() and not path.is_file():  # a name that is too long says so here
            raise InputError(f"{path}: is no file but a device or the like, and a file is to be written")
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    if not os.access(folder, os.W_OK):
        raise InputError(f"{path}: its folder {folder} cannot be written to")


def check_apart(outputs: Mapping[str, str | None], read: Iterable[str | None], what: str = "is read") -> None:
    """Raise InputError if two of these options write one file, or one writes what is read.

    Parameters
    ----------
    outputs : mapping
        Names by option; None where an option is not given.
    read : iterable of paths
        What the outputs are made of; names of no file (those of presets) and None are passed over.
    what : str
        How a message calls that.
    """
    chosen = {option: path for option, path in outputs.items() if path is not None}
    for (one, path), (other, another) in itertools.combinations(chosen.items(), 2):
        if os.path.realpath(path) == os.path.realpath(another):
            raise InputError(f"{another}: {one} and {other} have to be two files")
    sources = [path for path in read if path is not None and os.path.exists(path)]
    for option, path in chosen.items():
        if os.path.exists(path) and any(os.path.samefile(path, each) for each in sources):
            raise InputError(f"{path}: {what}, and would be lost: give {option} another name")


def beside(path: Path) -> Path:
    """A name of our own in the same folder, for what is to be renamed to `path` when it is whole."""
    return path.with_name(f".texvol-{os.getpid()}-{next(_numbers)}")


def write_files(files: Mapping[str | os.PathLike[str], bytes]) -> None:
    """Write all of these files, or none.

    Raises
    ------
    InputError
        If one can't be written, a full disk included.
    """
    scratch: dict[Path, Path] = {}
    try:
        for name, content in files.items():
            path = Path(os.path.realpath(name))  # what a link points to, not the link
            check_writable(path)
            scratch[path] = beside(path)
            try:
                scratch[path].write_bytes(content)
            except OSError as error:
                raise InputError(f"{name}: cannot be written: {error.strerror or error}") from None
        for path, written in scratch.items():
            os.replace(written, path)
    except OSError as error:
        raise InputError(f"{error.filename2 or error.filename}: cannot be written: {error.strerror}") from None
    finally:
        for written in scratch.values():
            with contextlib.suppress(OSError):
                written.unlink()
