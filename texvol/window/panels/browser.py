"""File browser, which chooses a file to open or to write.

It replaces the dialogs of desktops, which need programs that many machines with a display do not have.
"""

from __future__ import annotations

from imgui_bundle import imgui

from texvol.window.browsing import Browser
from texvol.window.desk import Desk
from texvol.window.panels import parts

_SIZE = imgui.ImVec2(560, 440)
_WORDS = "reading options: --channel 1   --shape 64,64,64 --dtype uint8   --labels …"


def show(desk: Desk) -> None:
    """Show the file browser if it is open."""
    browser = desk.browser
    if browser is None:
        return
    viewport, scale = desk.viewport, parts.scale()
    size = imgui.ImVec2(min(_SIZE.x * scale, max(viewport.width, 200)), min(_SIZE.y * scale, max(viewport.height, 160)))
    middle = imgui.ImVec2(viewport.x + viewport.width / 2, viewport.y + viewport.height / 2)
    imgui.set_next_window_pos(middle, imgui.Cond_.appearing.value, imgui.ImVec2(0.5, 0.5))
    imgui.set_next_window_size(size, imgui.Cond_.appearing.value)
    _, stays = imgui.begin(f"{browser.title}###browser", True, imgui.WindowFlags_.no_collapse.value)
    if imgui.is_window_appearing():
        imgui.set_window_focus()
    _path(browser)
    rows = 2 if browser.saves or browser.takes_words else 1
    foot = rows * imgui.get_frame_height_with_spacing()
    imgui.begin_child("entries", imgui.ImVec2(0, -foot), imgui.ChildFlags_.frame_style.value)
    _entries(browser)
    imgui.end_child()
    _foot(desk, browser)
    focused = imgui.is_window_focused(imgui.FocusedFlags_.root_and_child_windows.value)
    imgui.end()
    escaped = focused and imgui.is_key_pressed(imgui.Key.escape) and not imgui.is_any_item_active()
    if (browser.over or not stays or escaped) and desk.browser is browser:
        desk.browser = None


def _path(browser: Browser) -> None:
    if imgui.button("up"):
        browser.go(browser.folder.parent)
    imgui.same_line()
    imgui.set_next_item_width(-1)
    entered, text = imgui.input_text("##folder", str(browser.folder), imgui.InputTextFlags_.enter_returns_true.value)
    if entered and text:
        browser.enter(text)


def _entries(browser: Browser) -> None:
    listing = browser.listing
    if listing.fault:
        imgui.text_wrapped(listing.fault)
    if listing.entries is None:
        imgui.text_disabled("…")
        return
    for number, entry in enumerate(listing.entries):
        imgui.push_id(number)
        text = f"{entry.name}/" if entry.is_folder else entry.name
        flags = imgui.SelectableFlags_.allow_double_click.value
        clicked, _ = imgui.selectable(text, entry.name == browser.name, flags)
        imgui.pop_id()
        if clicked and imgui.is_mouse_double_clicked(0):
            browser.pick(entry)
            return  # the entries are those of another folder now
        if clicked and not (browser.saves and entry.is_folder):
            browser.name = entry.name


def _foot(desk: Desk, browser: Browser) -> None:
    if browser.saves:
        imgui.set_next_item_width(-1)
        flags = imgui.InputTextFlags_.enter_returns_true.value
        entered, browser.name = imgui.input_text("##name", browser.name, flags)
        if entered:
            browser.accept()
    if browser.takes_words:
        imgui.set_next_item_width(-1)
        _, browser.words = imgui.input_text_with_hint("##words", _WORDS, browser.words)
        imgui.set_item_tooltip("options of the command line that say how to read the file")
    imgui.begin_disabled(not browser.name)
    if imgui.button(("replace" if browser.replaces else "save") if browser.saves else "open"):
        browser.accept()
    imgui.end_disabled()
    imgui.same_line()
    if imgui.button("cancel"):
        browser.over = True
    if not browser.saves:
        imgui.same_line()
        if imgui.button("open this folder"):
            browser.choose(browser.folder)
        imgui.set_item_tooltip("as an image series (DICOM)")
