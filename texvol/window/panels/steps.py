"""Undo and redo buttons."""

from __future__ import annotations

from imgui_bundle import imgui

from texvol.window import commands
from texvol.window.desk import Desk
from texvol.window.document import Document

_NAMES = ("undo", "redo")


def width() -> float:
    """Return the width of the two buttons beside another control, including the spacing before them."""
    style = imgui.get_style()
    return sum(imgui.calc_text_size(name).x + 2 * style.frame_padding.x + style.item_spacing.x for name in _NAMES)


def show(desk: Desk, document: Document) -> None:
    """Show the two buttons; a button is disabled if there is no step."""
    history = document.history
    for position, (name, can) in enumerate(zip(_NAMES, (history.can_undo, history.can_redo), strict=True)):
        if position:
            imgui.same_line()
        imgui.begin_disabled(not can)
        if imgui.button(name):
            commands.run(desk, name)
        imgui.end_disabled()
