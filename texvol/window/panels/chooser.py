"""Buttons and lists that show strips: of looks, of colour maps, of opacity shapes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby

from imgui_bundle import imgui

from texvol.window.catalogue import Sheet
from texvol.window.desk import Desk
from texvol.window.look_list import Entry, best_match
from texvol.window.panels import parts, tips
from texvol.window.strips import Pixels

_STRIP = 0.36  # of a row's width
_TALL = 18.0  # of a strip in a list, in window coordinates at scale 1, as are the following
_LOWEST, _NARROWEST, _WIDEST = 180.0, 200.0, 460.0  # height and width of a list
_MARKED, _FRAME = 0xFF_FF_B8_73, 0xFF_50_48_42  # ABGR
_ARROWS = {imgui.Key.down_arrow: 1, imgui.Key.up_arrow: -1}


@dataclass
class Listing:
    """State of a list while it is shown: the search words, the marked row, and what the next frame begins with."""

    words: str = ""
    marked: str = ""
    focuses: bool = False
    scrolls: bool = False


def button(desk: Desk, label: str, title: str, key: object, strip: Callable[[], Pixels], width: float = -1.0) -> bool:
    """Show a button with a strip and a title; return True if it is pressed.

    Parameters
    ----------
    key : object
        The strip is made again if the key is another than in the last frame.
    """
    style, height = imgui.get_style(), imgui.get_frame_height()
    width = imgui.get_content_region_avail().x if width < 0 else width
    corner = imgui.get_cursor_screen_pos()
    pressed = bool(imgui.button(f"##{label}", imgui.ImVec2(width, height)))
    tips.show(f"##{label}")
    draw, pad = imgui.get_window_draw_list(), 3.0 * parts.scale()
    left, right = corner.x + pad, corner.x + pad + _STRIP * width
    if desk.textures is not None:
        texture = imgui.ImTextureRef(desk.textures.get(f"strip {label}", key, strip))
        draw.add_image(
            texture, imgui.ImVec2(left, corner.y + pad), imgui.ImVec2(right, corner.y + height - pad)
        )  # fmt: skip
    arrow = corner.x + width - height
    _text(draw, title, right + 2 * style.item_inner_spacing.x, corner.y + style.frame_padding.y, arrow)
    middle, size = corner.y + height / 2, 0.16 * height
    at = arrow + height / 2
    draw.add_triangle_filled(
        imgui.ImVec2(at - size, middle - size / 2),
        imgui.ImVec2(at + size, middle - size / 2),
        imgui.ImVec2(at, middle + size / 2),
        imgui.get_color_u32(imgui.Col_.text),
    )
    return pressed


def open_list(label: str, listing: Listing, current: str) -> None:
    """Open a list, with the current entry marked."""
    listing.words, listing.marked, listing.focuses, listing.scrolls = "", current, True, True
    imgui.open_popup(label)


def choice(
    desk: Desk, label: str, listing: Listing, entries: Sequence[Entry], sheet: Sheet, current: str,
    faults: dict[str, str], top: Callable[[], None] | None = None,
) -> str | None:  # fmt: skip
    """Show a list if it is open; return the key of the entry that is chosen in this frame.

    A click, or Enter after a search, chooses and closes the list; arrows choose and leave it open, so that entries can
    be compared.
    """
    if not imgui.is_popup_open(label):
        return None
    _place(entries, 1 if top is None else 2)
    if not imgui.begin_popup(label):
        return None
    imgui.push_item_width(-1)
    if listing.focuses:
        imgui.set_keyboard_focus_here()
    edited, listing.words = imgui.input_text_with_hint("##words", f"search {len(entries)} entries", listing.words)
    imgui.set_item_tooltip("words of a name, a group or a description; up and down choose, Enter closes")
    imgui.pop_item_width()
    if top is not None:
        top()
    found = [each for each in entries if each.matches(listing.words)]
    if edited:
        listing.marked, listing.scrolls = best_match(found, listing.words) or current, True
    chosen = _by_keys(listing, found)
    imgui.begin_child("rows", imgui.ImVec2(0, 0))
    for group, members in groupby(found, key=lambda each: each.group):
        imgui.separator_text(group)
        for entry in members:
            if _row(desk, label, entry, sheet, entry.key == listing.marked, faults.get(entry.key)):
                chosen = entry.key
                imgui.close_current_popup()
            if listing.marked == entry.key and listing.scrolls:
                imgui.set_scroll_here_y()
    if not found:
        imgui.text_disabled("nothing has these words")
    imgui.end_child()
    listing.focuses = listing.scrolls = False
    if chosen is None and imgui.is_key_pressed(imgui.Key.enter, False):
        chosen = listing.marked if listing.words and found else None
        imgui.close_current_popup()
    imgui.end_popup()
    return chosen


def _by_keys(listing: Listing, found: Sequence[Entry]) -> str | None:
    """Return the key of the entry that an arrow key leads to."""
    keys = [each.key for each in found]
    for key, by in _ARROWS.items():
        if keys and imgui.is_key_pressed(key):
            at = keys.index(listing.marked) + by if listing.marked in keys else (0 if by > 0 else -1)
            listing.marked, listing.scrolls = keys[min(max(at, 0), len(keys) - 1)], True
            return listing.marked
    return None


def _place(entries: Sequence[Entry], rows: int) -> None:
    """Place the list below the last control, as high as its entries and rows of controls, if the window is."""
    style = imgui.get_style()
    needed = rows * imgui.get_frame_height_with_spacing() + 2 * style.window_padding.y
    needed += len({each.group for each in entries}) * imgui.get_text_line_height_with_spacing()
    needed += (len(entries) + 1) * (_row_height() + style.item_spacing.y)
    scale, above = parts.scale(), imgui.get_item_rect_max().y
    display, left = imgui.get_io().display_size, imgui.get_cursor_screen_pos().x
    height = min(max(display.y - above - 8 * scale, min(_LOWEST * scale, display.y)), needed)
    width = max(min(imgui.get_content_region_avail().x, _WIDEST * scale), _NARROWEST * scale)
    imgui.set_next_window_pos(imgui.ImVec2(left, min(above + 2 * scale, display.y - height)))
    imgui.set_next_window_size(imgui.ImVec2(width, height))


def _row_height() -> float:
    return float(max(_TALL * parts.scale(), imgui.get_text_line_height()) + 4 * parts.scale())


def _row(desk: Desk, label: str, entry: Entry, sheet: Sheet, marked: bool, fault: str | None) -> bool:
    """Show an entry; return True if it is clicked."""
    scale, style = parts.scale(), imgui.get_style()
    tall, width = _TALL * scale, imgui.get_content_region_avail().x
    height = _row_height()
    corner = imgui.get_cursor_screen_pos()
    imgui.push_id(entry.key)
    pressed = bool(imgui.selectable("##row", marked, 0, imgui.ImVec2(width, height))[0])
    imgui.pop_id()
    imgui.set_item_tooltip(fault or entry.text)
    draw, top = imgui.get_window_draw_list(), corner.y + (height - tall) / 2
    left, right = corner.x + 2 * scale, corner.x + _STRIP * width
    start, end = imgui.ImVec2(left, top), imgui.ImVec2(right, top + tall)
    place = sheet.place(entry.key)
    if place is not None and desk.textures is not None:
        texture = imgui.ImTextureRef(desk.textures.get(f"sheet {label}", (sheet, sheet.version), lambda: sheet.pixels))
        draw.add_image(texture, start, end, imgui.ImVec2(0, place[0]), imgui.ImVec2(1, place[1]))
    draw.add_rect(start, end, _MARKED if marked else _FRAME)
    text = corner.y + (height - imgui.get_text_line_height()) / 2
    color = imgui.Col_.text_disabled if fault else imgui.Col_.text
    _text(draw, entry.name, right + 2 * style.item_inner_spacing.x, text, corner.x + width, color)
    return pressed and fault is None


def _text(
    draw: imgui.ImDrawList, text: str, left: float, top: float, right: float, color: imgui.Col_ = imgui.Col_.text
) -> None:
    """Draw a text on one line, cut off at the right."""
    end = imgui.ImVec2(max(right, left), top + imgui.get_text_line_height())
    draw.push_clip_rect(imgui.ImVec2(left, top), end, True)
    draw.add_text(imgui.ImVec2(left, top), imgui.get_color_u32(color), text)
    draw.pop_clip_rect()
