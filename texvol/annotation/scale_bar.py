"""Scale bar of a round length; in perspective it holds at the depth of the camera's target."""

from __future__ import annotations

from decimal import Decimal

from texvol.annotation import rounding
from texvol.annotation.sheet import Rect, Sheet
from texvol.annotation.view import View

_MOST = 1 / 3  # longest bar, as a fraction of the picture's width
_THICKNESS, _FROM_BORDER, _GAP = 0.22, 0.8, 0.35  # ems


def bar_length(view: View) -> tuple[Decimal, float]:
    """Return the bar's length in world units, and in pixels."""
    pixel = view.pixel_size(view.camera.target_distance)
    length = rounding.round_down(_MOST * view.size[0] * pixel)
    return length, float(length) / pixel


def bar_text(view: View, length: Decimal) -> str:
    """Return the text at the bar."""
    where = " at the target" if view.camera.projection == "perspective" else ""
    return rounding.length(length, view.volume.unit) + where


def draw_scale_bar(sheet: Sheet, view: View) -> None:
    """Draw the bar in the lower left corner, with its length above it."""
    length, pixels = bar_length(view)
    text = bar_text(view, length)
    across, down = sheet.text_size(text)
    em = sheet.em
    left, bottom = _FROM_BORDER * em, sheet.size[1] - _FROM_BORDER * em
    bar = Rect(left, bottom - max(_THICKNESS * em, 1.0), left + pixels, bottom)
    # The text is centred above the bar; the longer of the two begins at the left.
    middle = (left + max(across, pixels) / 2, bar.top - _GAP * em - down / 2)
    if across > pixels:
        bar = Rect(left + (across - pixels) / 2, bar.top, left + (across + pixels) / 2, bottom)
    written = sheet.text_rect(text, middle)
    both = Rect(min(bar.left, written.left), written.top, max(bar.right, written.right), bar.bottom)
    if sheet.fits(both):
        sheet.taken.append(both)
        sheet.rectangle(bar, outlined=True)
        sheet.text(text, middle)
