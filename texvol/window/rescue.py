"""Unsaved scenes of a window that ends by an error of its own: they are written into the user's state folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from texvol.util.errors import TexvolError
from texvol.window import recent, saving
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.own_files import unused


@contextmanager
def rescuing(desk: Desk) -> Iterator[None]:
    """Write unsaved scenes if an error ends the block, name their files in a note of the error, and raise it."""
    try:
        yield
    except TexvolError:  # of the first file: nothing is open yet
        raise
    except Exception as error:
        for path in save(desk):
            error.add_note(f"texvol: the unsaved scene is in {path}, and among the recent files")
        raise


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
    path = unused(str(folder / f"{stem}.toml"), lambda name: saving.files_of(name, document))
    saving.save_scene(path, document, size)
    recent.remember(path, None)
    return path
