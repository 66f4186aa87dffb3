"""The outline of a volume's box: edges before the matter cover it, edges behind are seen through it."""

from __future__ import annotations

from texvol.annotation.sheet import Sheet
from texvol.annotation.view import EDGES, View

# A little less than text and ticks, so that these stand out; hidden edges less again, as draughtsmen have it.
_SEEN, _HIDDEN = 0.8, 0.5


def draw_box(sheet: Sheet, view: View) -> None:
    """Draw what lies before the eye of the twelve edges."""
    for edge in EDGES:
        ends = view.edge(edge)
        if ends is not None:
            hidden = view.faces_that_show(edge) == 0
            sheet.line(*ends, "behind" if hidden else "box", opacity=_HIDDEN if hidden else _SEEN)
