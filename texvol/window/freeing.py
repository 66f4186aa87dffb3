"""Memory of replaced documents: the oldest are dropped when it gets scarce, and unsaved ones only with consent."""

from __future__ import annotations

from texvol.window import exporting
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.questions import Question


def limit(desk: Desk) -> None:
    """After a document was replaced, drop the oldest if they take too much memory; ask before unsaved changes go."""
    if not desk.has_replaced:
        return
    desk.has_replaced = False
    for document in desk.replaced.excess(desk.document):
        if document.unsaved:
            _ask_to_drop(desk, document)
            return
        desk.replaced.drop(document)
        desk.say(f"{document.name} was closed to free memory: undo does not return to it")


def _ask_to_drop(desk: Desk, document: Document) -> None:
    def drop() -> None:
        desk.replaced.drop(document)
        desk.has_replaced = True  # others may have to go as well

    desk.ask(
        Question(
            f"{document.name} has unsaved changes, and memory gets scarce.",
            {
                "save it and let it go": lambda: exporting.scene(desk, document, then=drop),
                "let it go unsaved": drop,
            },
            ("If you cancel, it is kept, and undo returns to it.",),
            cancel=lambda: desk.replaced.kept.append(document),
        )
    )
