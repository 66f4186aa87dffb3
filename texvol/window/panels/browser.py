"""Dialog of the file browser; it keeps all input from the picture.

It replaces the file dialogs of desktops, which need programs that many machines with a display do not have.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

from imgui_bundle import imgui

from texvol.window.browsing import Browser
from texvol.window.desk import Desk
from texvol.window.listing import HERE, Entry, Order, size_text
from texvol.window.panels import parts

_SIZE = imgui.ImVec2(820, 560)  # window coordinates at scale 1
_MARGIN = 24.0  # between the dialog and the edges of the window
_PLACES = 150.0  # width of the list of folders
_FEWEST = 560.0  # width of the dialog from which on the list of folders is shown
_WORDS = "reading options: --channel 1   --shape 64,64,64 --dtype uint8   --labels …"
_COLUMNS: tuple[tuple[Order, float], ...] = (("name", 0.0), ("size", 80.0), ("date", 130.0))
_NAME = "###browser"


def browse(desk: Desk) -> None:
    """Show the file browser if it is open; a question hides it until it is answered."""
    browser = desk.browser
    if browser is None or desk.question is not None:
        parts.close_dialog(_NAME)
        return
    if not imgui.is_popup_open(_NAME):
        imgui.open_popup(_NAME)
    whole, scale = imgui.get_io().display_size, parts.scale()
    room = imgui.ImVec2(max(whole.x - _MARGIN, 120), max(whole.y - _MARGIN, 120))
    size = imgui.ImVec2(min(_SIZE.x * scale, room.x), min(_SIZE.y * scale, room.y))
    imgui.set_next_window_size(size, imgui.Cond_.always.value)
    imgui.set_next_window_pos(whole * 0.5, imgui.Cond_.always.value, imgui.ImVec2(0.5, 0.5))
    flags = imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_resize
    visible, stays = imgui.begin_popup_modal(f"{browser.title}{_NAME}", True, flags)
    if not visible:
        browser.over |= not stays
        _end(desk, browser)
        return
    _field(browser)
    for fault in filter(None, (browser.fault, browser.listing.fault)):
        imgui.text_wrapped(fault)
    foot = (2 if browser.takes_words else 1) * imgui.get_frame_height_with_spacing()
    if size.x >= _FEWEST * scale and browser.places:
        _places(browser, foot)
        imgui.same_line()
    _entries(browser, foot)
    _foot(browser)
    browser.over |= not stays
    if browser.over:
        imgui.close_current_popup()
    imgui.end_popup()
    _end(desk, browser)


def _end(desk: Desk, browser: Browser) -> None:
    if browser.over and desk.browser is browser:
        desk.browser = None


def _field(browser: Browser) -> None:
    """Show the folder, the button to the folder above, and the field of a path or a name."""
    if imgui.button("up"):
        browser.up()
    imgui.set_item_tooltip("the folder above (backspace)")
    imgui.same_line()
    imgui.align_text_to_frame_padding()
    imgui.text_unformatted(_shortened(str(browser.folder)))
    imgui.set_item_tooltip(str(browser.folder))
    if browser.wants_field:
        imgui.set_keyboard_focus_here()
        browser.wants_field = False
    imgui.set_next_item_width(-1)

    def edit(data: Any) -> int:
        if data.event_flag == imgui.InputTextFlags_.callback_always:
            _follow_led(data, browser)
            return 0
        text = browser.completed(data.buf)
        if text != data.buf:
            data.delete_chars(0, data.buf_text_len)
            data.insert_chars(0, text)
        return 0

    flags = imgui.InputTextFlags_.enter_returns_true | imgui.InputTextFlags_.callback_completion
    flags |= imgui.InputTextFlags_.callback_always
    hint = "name of the file" if browser.saves else "path; Tab completes it, Enter opens it"
    entered, text = imgui.input_text_with_hint("##path", hint, browser.text, flags, edit)
    imgui.set_item_tooltip(hint)
    if imgui.is_item_active() or entered:
        browser.typing(text)
        browser.name = text if browser.saves else browser.name
    if entered and text:
        browser.enter(text)


def _follow_led(data: Any, browser: Browser) -> None:
    """Put letters that led to the field into it, and the cursor behind them.

    Dear ImGui selects the text of a field that gets the keyboard, and drops the letters of that frame, which come to
    the browser after it. The first call is that of this frame, in which the field has all letters before them.
    """
    if not browser.led:
        return
    letters = browser.led.encode()
    if browser.held:
        data.insert_chars(browser.held, letters[browser.held :].decode())
    browser.held = len(letters)
    data.cursor_pos = data.selection_start = data.selection_end = data.buf_text_len
    if imgui.get_io().want_text_input:  # from now on the browser hears no letters
        browser.led, browser.held = "", 0


def _shortened(text: str) -> str:
    """Return a path that fits into the line; folders at its beginning give way."""
    room = imgui.get_content_region_avail().x
    names = text.split(os.sep)
    while len(names) > 2 and imgui.calc_text_size(os.sep.join(["…", *names])).x > room:
        names.pop(0)
    shown = os.sep.join(names)
    return shown if shown == text else f"…{os.sep}{shown}"


def _places(browser: Browser, foot: float) -> None:
    """Show folders that were used lately."""
    imgui.begin_child("places", imgui.ImVec2(_PLACES * parts.scale(), -foot), imgui.ChildFlags_.frame_style.value)
    for number, folder in enumerate(browser.places):
        imgui.push_id(number)
        name = "home" if folder == Path.home() else folder.name or str(folder)
        if imgui.selectable(name, folder == browser.folder)[0]:
            browser.go(folder)
        imgui.set_item_tooltip(str(folder))
        imgui.pop_id()
    imgui.end_child()


def _entries(browser: Browser, foot: float) -> None:
    """Show the table of entries."""
    entries, scale = browser.entries, parts.scale()
    flags = imgui.TableFlags_.scroll_y | imgui.TableFlags_.row_bg | imgui.TableFlags_.sortable
    flags |= imgui.TableFlags_.no_saved_settings | imgui.TableFlags_.borders_outer
    if not imgui.begin_table("entries", len(_COLUMNS), flags, imgui.ImVec2(0, -foot)):
        return
    imgui.table_setup_scroll_freeze(0, 1)
    for name, width in _COLUMNS:
        how = imgui.TableColumnFlags_.width_fixed if width else imgui.TableColumnFlags_.width_stretch
        imgui.table_setup_column(name, how, width * scale)
    imgui.table_next_row(imgui.TableRowFlags_.headers.value)
    for name, _ in _COLUMNS:
        imgui.table_next_column()
        imgui.table_header(name)
        imgui.set_item_tooltip(f"sort by {name}; once more: the other way round")
    _sort(browser)
    if not entries and not browser.listing.fault:
        imgui.table_next_row()
        imgui.table_next_column()
        imgui.text_disabled("…" if entries is None else "no files are here")
    picked = _rows(browser, entries or [])
    imgui.end_table()
    if picked is not None:
        browser.pick(picked)


def _sort(browser: Browser) -> None:
    """Take the order over from the headers that were clicked."""
    specs = imgui.table_get_sort_specs()
    if specs is not None and specs.specs_count and specs.specs_dirty:
        first = specs.get_specs(0)
        descending = first.get_sort_direction() == imgui.SortDirection.descending
        browser.order = _COLUMNS[first.column_index][0], descending
        specs.specs_dirty = False


def _rows(browser: Browser, entries: list[Entry]) -> Entry | None:
    """Show the rows that are visible; return the entry that was double-clicked."""
    picked, selected = None, browser.selected
    number = entries.index(selected) if selected in entries else -1
    clipper = imgui.ListClipper()
    clipper.begin(len(entries))
    if number >= 0 and browser.moved:
        clipper.include_item_by_index(number)
    while clipper.step():
        for position in range(clipper.display_start, clipper.display_end):
            imgui.push_id(position)
            if _row(browser, entries[position], is_selected=position == number):
                picked = entries[position]
            imgui.pop_id()
    return picked


def _row(browser: Browser, entry: Entry, *, is_selected: bool) -> bool:
    """Show the row of an entry; return True if it is double-clicked."""
    imgui.table_next_row()
    imgui.table_next_column()
    dims = not entry.is_known
    if dims:
        imgui.push_style_color(imgui.Col_.text.value, imgui.get_style_color_vec4(imgui.Col_.text_disabled.value))
    here = f"this folder: {entry.what}" + (" store" if entry.what == "Zarr" else " slices as one volume")
    text = here if entry.name == HERE else f"{entry.name}/" if entry.is_folder else entry.name
    flags = imgui.SelectableFlags_.allow_double_click | imgui.SelectableFlags_.span_all_columns
    clicked, _ = imgui.selectable(parts.fitting(text, imgui.get_content_region_avail().x), is_selected, flags)
    imgui.set_item_tooltip(text if entry.is_known or entry.is_folder else f"{text}: no file that texvol reads")
    if is_selected and browser.moved:
        imgui.set_scroll_here_y(0.5)
        browser.moved = False
    imgui.table_next_column()
    imgui.text_unformatted(size_text(entry.size))
    imgui.table_next_column()
    if entry.modified:
        imgui.text_unformatted(time.strftime("%Y-%m-%d %H:%M", time.localtime(entry.modified)))
    if dims:
        imgui.pop_style_color()
    if clicked:
        browser.select(entry)
    return bool(clicked and imgui.is_mouse_double_clicked(0))


def _foot(browser: Browser) -> None:
    if browser.takes_words:
        imgui.set_next_item_width(-1)
        entered = imgui.InputTextFlags_.enter_returns_true.value
        opens, browser.words = imgui.input_text_with_hint("##words", _WORDS, browser.words, entered)
        imgui.set_item_tooltip("options of the command line that say how to read the file; Enter opens it")
        if opens:
            browser.press()
    typed = bool(browser.text) and not browser.saves
    folder = not typed and browser.selected is not None and browser.selected.is_folder and not browser.saves
    imgui.begin_disabled(not browser.name and not typed)
    if imgui.button("choose" if browser.saves else "enter" if folder else "open"):
        browser.press()
    imgui.end_disabled()
    imgui.set_item_tooltip("Enter")
    imgui.same_line()
    if imgui.button("cancel"):
        browser.over = True
    imgui.set_item_tooltip("Escape")
    imgui.same_line()
    if parts.switch("hidden files", browser.hidden) != browser.hidden:
        browser.show_hidden()
    imgui.set_item_tooltip("names that begin with a dot (ctrl-h)")
