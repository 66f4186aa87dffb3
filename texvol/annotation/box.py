"""Outline of a volume's box: near edges cover the medium, far edges are seen through it."""

from __future__ import annotations

from texvol.annotation.sheet import Sheet
from texvol.annotation.view import EDGES, View

# Opacities, less than that of text and ticks; hidden edges are fainter, as in technical drawings.
_SEEN, _HIDDEN = 0.8, 0.5


def draw_box(sheet: Sheet, view: View) -> None:
    """Draw the visible parts of the twelve edges."""
    for edge in EDGES:
        ends = view.edge(edge)
        if ends is not None:
            hidden = view.faces_that_show(edge) == 0
            sheet.line(*ends, "behind" if hidden else "box", opacity=_HIDDEN if hidden else _SEEN)
