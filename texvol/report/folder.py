"""Folder of a report: checked before the work, and written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from texvol.util import writing
from texvol.util.errors import InputError, missing_extra


def check_folder(folder: str | os.PathLike[str]) -> None:
    """Raise InputError if the report can't be written to `folder`; called before the measurements."""
    path = Path(folder)
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: the report needs a folder, got a file")
    written = path if path.is_dir() else path.absolute().parent
    if not written.is_dir():
        raise InputError(f"{path}: its folder {written} does not exist")
    if not os.access(written, os.W_OK):
        raise InputError(f"{path}: no permission to write")


def check_libraries(command: str = "texvol report") -> None:
    """Raise MissingExtraError if a library that a report needs is not installed."""
    for library in ("matplotlib", "rich"):
        try:
            import_module(library)
        except ImportError as error:
            raise missing_extra(library, "report", command) from error


def write_folder(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write all files, or neither files nor folder."""
    is_new = not folder.exists()
    try:
        folder.mkdir(exist_ok=True)
        writing.write_files({folder / name: content for name, content in files.items()})
    except OSError as error:
        raise InputError(f"{folder}: cannot be created: {error.strerror or error}") from None
    finally:
        if is_new and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
