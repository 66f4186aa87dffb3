"""Unsaved scenes of a window that ends by an error of its own or by a signal, written into the user's state folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from texvol.util.errors import TexvolError
from texvol.util.terminal import complain
from texvol.util.termination import Terminated
from texvol.window import recent, saving
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.own_files import unused


@contextmanager
def rescuing(desk: Desk) -> Iterator[None]:
    """Write unsaved scenes if an error or a signal ends the block, tell their files, and raise it again.

    The files are named in notes of the error; after a signal, which is no error to look into, on stderr.
    """
    try:
        yield
    except TexvolError:  # of the first file: nothing is open yet
        raise
    except Exception as error:
        for path in save(desk):
            error.add_note(f"texvol: {_told(path)}")
        raise
    except (KeyboardInterrupt, Terminated):  # nobody can be asked
        for path in save(desk):
            with suppress(OSError):  # the terminal may be gone
                complain(_told(path))
        raise


def _told(path: str) -> str:
    return f"the unsaved scene is in {path}, and among the recent files"


def save(desk: Desk) -> list[str]:
    """Write all unsaved scenes, and return their files; a scene that can't be written is left out."""
    folder, found = recent.state_file().parent / "rescued", []
    for document in desk.documents:
        if document.unsaved:
            with suppress(Exception):  # the error that ends the window is the one to be told
                found.append(_written(document, folder, desk.layout.alone(desk.pixels)))
    return found


def _written(document: Document, folder: Path, size: tuple[int, int]) -> str:
    """Write a scene into a folder, and return its file."""
    folder.mkdir(parents=True, exist_ok=True)
    stem = Path(document.name).name.split(".")[0] or "scene"
    path = _taken(str(folder / f"{stem}.toml"), document)
    try:
        saving.save_scene(path, document, size)
    except BaseException:
        os.unlink(path)
        raise
    recent.remember(path, None)
    return path


def _taken(wanted: str, document: Document) -> str:
    """Return the path of a new, empty file that no other window has: two that end at once look for names at once."""
    while True:
        path = unused(wanted, lambda name: saving.files_of(name, document))
        with suppress(FileExistsError), open(path, "x"):
            return path
