"""Closing of the window: the user is asked about unsaved scenes, and about a file that is being written."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence

from texvol.window import exporting, saving
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.own_files import real
from texvol.window.questions import Question


def close(desk: Desk) -> None:
    """Close the window, if need be after questions."""
    unsaved = [each for each in desk.documents if each.unsaved]
    if not unsaved:
        _end_writing(desk)
        return
    files = _files(desk, unsaved)
    count = f"{len(unsaved)} scenes have" if len(unsaved) > 1 else f"{unsaved[0].name} has"
    what = f"save {len(unsaved)} scenes" if len(unsaved) > 1 else f"save {os.path.basename(files[0])}"
    answers = {
        f"{what} and close": lambda: save_all(desk, unsaved),
        "close without saving": lambda: _end_writing(desk, unsaved),
    }
    desk.ask(Question(f"{count} unsaved changes.", answers, _notes(desk, unsaved, files) if len(unsaved) > 1 else ()))


def _notes(desk: Desk, documents: Sequence[Document], files: Sequence[str]) -> tuple[str, ...]:
    """Return a line for each scene with its name and its file; of scenes of one name, the shown one is marked."""
    names = [each.name for each in documents]
    shown = [each is desk.document and names.count(each.name) > 1 for each in documents]
    parts = zip(names, shown, files, strict=True)
    return tuple(f"{name}{' (shown)' * is_shown} → {os.path.basename(file)}" for name, is_shown, file in parts)


def _files(desk: Desk, documents: Sequence[Document], taken: Collection[str] = ()) -> list[str]:
    """Return the files in which scenes will be saved, each another one; the shown scene keeps its own."""
    shown, found = desk.document, list[str]()
    own = {real(shown.origin.scene_file)} if shown is not None and shown.origin.scene_file else set()
    for each in documents:
        others = {*taken, *map(real, found), *(own if each is not shown else ())}
        found.append(saving.scene_name(each, others))
    return found


def save_all(desk: Desk, documents: Sequence[Document], taken: Collection[str] = ()) -> None:
    """Save scenes one after the other, then close the window; a scene that can't be saved keeps it open.

    `taken` are the real paths of files in which others have just been saved.
    """
    if not documents:
        _end_writing(desk)
        return
    first, *others = documents
    (file,) = _files(desk, [first], taken)
    exporting.scene(desk, first, file, then=lambda: save_all(desk, others, {*taken, real(file)}))


def _end_writing(desk: Desk, abandoned: Sequence[Document] = ()) -> None:
    """Close the window; if a file is being written, ask first.

    The changes of `abandoned` documents are not asked about again, unless there are further ones.
    """
    if desk.writing is None:
        desk.wants_close = True
        return

    states = {id(each): (each.history.now, each.showing) for each in abandoned}

    def close_then() -> None:
        desk.when_written = None
        if any(each.unsaved and states.get(id(each)) != (each.history.now, each.showing) for each in desk.documents):
            close(desk)
        else:
            desk.wants_close = True

    def wait() -> None:
        desk.when_written = close_then
        desk.say(f"the window closes when {'all files are' if desk.orders else 'the file is'} written")

    def stop() -> None:
        desk.stop_writing()
        desk.wants_close = True

    more = f"{len(desk.orders) + 1} files are" if desk.orders else "A file is"
    text = f"{more} being written ({desk.writing * 100:.0f} %)."
    desk.ask(Question(text, {"close when written": wait, "stop and close": stop}))
