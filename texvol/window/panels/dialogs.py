"""Dialogs: the file browser, and the question about volumes that were dropped while a scene is open.

The file browser replaces those of desktops, which need programs that many machines with a display do not have.
"""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import imgui

from texvol.window import contents, opening
from texvol.window.browsing import Browser
from texvol.window.desk import Desk
from texvol.window.panels import parts

_SIZE = imgui.ImVec2(560, 440)  # of the browser, window coordinates at scale 1
_WIDTH = 300.0  # of the question's buttons
_WORDS = "reading options: --channel 1   --shape 64,64,64 --dtype uint8   --labels …"


def offer(desk: Desk) -> None:
    """Ask whether dropped volumes are to be opened or added, until the question is answered."""
    paths, document, viewport = desk.offered, desk.document, desk.viewport
    if not paths or document is None:
        return
    flags = imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_collapse
    stays = parts.begin_centred(viewport, f"{contents.named(paths)}###offer", flags)
    width = imgui.ImVec2(min(_WIDTH * parts.scale(), max(viewport.width - 40, 120)), 0)
    opens = "open and close this scene" if len(paths) == 1 else "open as one scene and close this one"
    answers: dict[str, Callable[[], None]] = {
        opens: lambda: opening.open_all(desk, paths),
        "add to the scene": lambda: opening.drop(desk, paths, adds=True),
        "use as a mask of the volume": lambda: opening.mask(desk, document.scene.volume, paths[0]),
        "cancel": lambda: None,
    }
    if len(paths) > 1 or document.scene.mask is not None:
        del answers["use as a mask of the volume"]
    pressed = [text for text in answers if imgui.button(text, width)]
    if document.unsaved:
        imgui.text_disabled("This scene has unsaved changes.")
    typing = imgui.is_any_item_active()
    if not typing and (imgui.is_key_pressed(imgui.Key.enter) or imgui.is_key_pressed(imgui.Key.keypad_enter)):
        pressed.append(opens)
    if not stays or imgui.is_key_pressed(imgui.Key.escape):
        pressed.append("cancel")
    imgui.end()
    if pressed:
        desk.offered = ()
        answers[pressed[0]]()


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
