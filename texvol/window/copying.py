"""Copying of the window's picture on behalf of the user."""

from __future__ import annotations

from numpy.typing import NDArray

from texvol.annotation import Annotation, annotate
from texvol.window.clipboard import program
from texvol.window.desk import Desk
from texvol.window.document import Document


def copy(desk: Desk) -> None:
    """Copy the picture of the window; a coarse one, of something that moves, only when it has become fine."""
    if desk.attempt(program):
        desk.clipboard.wanted = True
        desk.wake()


def update(desk: Desk) -> None:
    """Start copying if the picture is fine, and show what has come of it."""
    clipboard, shown = desk.clipboard, desk.director.shown
    while clipboard.outcome:
        text, is_fault = clipboard.outcome.pop(0)
        desk.say(text, fault=is_fault)
    if not clipboard.wanted or shown is None or desk.document is None:
        return
    if shown.state != "moving" and shown.version == desk.director.version:
        clipboard.start(shown.pixels, desk.director.at_rest, desk.wake, _Measures(desk.document))


class _Measures:
    """Draws the measures of a document, as it is now, into a picture of it: the window has them over its picture."""

    def __init__(self, document: Document) -> None:
        own = document.showing.annotation
        self._annotation = Annotation(
            measures=document.measures, color=own.color, font_size=own.font_size, font=own.font
        )  # fmt: skip
        self._scene = document.scene

    def __call__(self, picture: NDArray) -> NDArray:
        """Return the linear picture with the measures."""
        if not self._annotation:
            return picture
        return annotate(picture, self._scene, (picture.shape[1], picture.shape[0]), self._annotation)
