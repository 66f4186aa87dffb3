"""Back and forward in what was done."""

from __future__ import annotations

from imgui_bundle import imgui

from texvol.window.desk import Desk
from texvol.window.document import Document


def show(desk: Desk, document: Document) -> None:
    """Two buttons beside each other; grey where there is no step."""
    history = document.history
    for place, (name, can) in enumerate((("undo", history.can_undo), ("redo", history.can_redo))):
        if place:
            imgui.same_line()
        imgui.begin_disabled(not can)
        if imgui.button(name):
            desk.run(name)
        imgui.end_disabled()
