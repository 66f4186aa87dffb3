"""Dialogs: the question that waits for an answer, and the file browser; both keep all input from the picture.

The file browser replaces those of desktops, which need programs that many machines with a display do not have.
"""

from __future__ import annotations

from imgui_bundle import imgui

from texvol.window.browsing import Browser
from texvol.window.desk import Desk
from texvol.window.panels import parts

_SIZE = imgui.ImVec2(560, 440)  # of the browser, window coordinates at scale 1
_WIDTH = 380.0  # of a question
_CHOSEN, _OTHER = imgui.ImVec4(0.24, 0.42, 0.64, 1.0), imgui.ImVec4(0.22, 0.25, 0.29, 1.0)
_WORDS = "reading options: --channel 1   --shape 64,64,64 --dtype uint8   --labels …"


def ask(desk: Desk) -> None:
    """Show the question that waits for an answer, in front of everything else."""
    question = desk.question
    if question is None:
        return
    name = "###question"
    if not imgui.is_popup_open(name):
        imgui.open_popup(name)
    middle = imgui.get_io().display_size * 0.5
    imgui.set_next_window_pos(middle, imgui.Cond_.always.value, imgui.ImVec2(0.5, 0.5))
    width = min(_WIDTH * parts.scale(), 2 * middle.x - 40)
    imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0), imgui.ImVec2(width, 2 * middle.y))
    flags = imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_title_bar | imgui.WindowFlags_.no_move
    if not imgui.begin_popup_modal(name, None, flags)[0]:
        return
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(question.text)
    for note in filter(None, question.notes):
        imgui.text_disabled(note)
    imgui.pop_text_wrap_pos()
    imgui.spacing()
    pressed = [words for number, words in enumerate(question.words) if _answer(words, number == question.chosen)]
    if pressed:
        desk.reply(pressed[0])
    if desk.question is not question:
        imgui.close_current_popup()
    imgui.end_popup()


def _answer(words: str, is_chosen: bool) -> bool:
    """Show the button of an answer, marked if Enter gives it; return True if it is pressed."""
    imgui.push_style_color(imgui.Col_.button.value, _CHOSEN if is_chosen else _OTHER)
    pressed = imgui.button(words, imgui.ImVec2(-1, 0))
    imgui.pop_style_color()
    return bool(pressed)


def browse(desk: Desk) -> None:
    """Show the file browser if it is open."""
    browser = desk.browser
    if browser is None:
        return
    viewport, scale = desk.viewport, parts.scale()
    size = imgui.ImVec2(min(_SIZE.x * scale, max(viewport.width, 200)), min(_SIZE.y * scale, max(viewport.height, 160)))
    imgui.set_next_window_size(size, imgui.Cond_.appearing.value)
    stays = parts.begin_centred(viewport, f"{browser.title}###browser", imgui.WindowFlags_.no_collapse.value)
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
