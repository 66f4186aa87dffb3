"""Closing of the window: the user is asked about unsaved scenes, and about a file that is being written."""

from __future__ import annotations

import os
from collections.abc import Sequence

from texvol.window import exporting, saving
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.questions import Question


def close(desk: Desk) -> None:
    """Close the window, if need be after questions."""
    unsaved = [each for each in desk.documents if each.unsaved]
    if not unsaved:
        _end_writing(desk)
        return
    names = [each.name for each in unsaved]
    count = f"{len(unsaved)} scenes have" if len(unsaved) > 1 else f"{names[0]} has"
    what = f"save {len(unsaved)} scenes" if len(unsaved) > 1 else f"save {_file(unsaved[0])}"
    answers = {
        f"{what} and close": lambda: save_all(desk, unsaved),
        "close without saving": lambda: _end_writing(desk, unsaved),
    }
    notes = tuple(f"{each.name} → {_file(each)}" for each in unsaved) if len(unsaved) > 1 else ()
    desk.ask(Question(f"{count} unsaved changes.", answers, notes))


def _file(document: Document) -> str:
    return os.path.basename(saving.scene_name(document))


def save_all(desk: Desk, documents: Sequence[Document]) -> None:
    """Save scenes one after the other, then close the window; a scene that can't be saved keeps it open."""
    if not documents:
        _end_writing(desk)
        return
    first, *others = documents
    exporting.scene(desk, first, then=lambda: save_all(desk, others))


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
        desk.say("the window closes when the file is written")

    def stop() -> None:
        desk.stop_writing()
        desk.wants_close = True

    more = f"{len(desk.orders) + 1} files are" if desk.orders else "A file is"
    text = f"{more} being written ({desk.writing * 100:.0f} %)."
    desk.ask(Question(text, {"close when written": wait, "stop and close": stop}))
