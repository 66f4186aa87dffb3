"""Contents of the window: the picture, texts and handles over it, and the side panel."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import imgui

from texvol.window.commands import TABS
from texvol.window.desk import PANEL_WIDTH, Desk
from texvol.window.document import Document
from texvol.window.panels import (
    browser,
    camera,
    contents,
    cut,
    edge,
    files,
    grips,
    light,
    offer,
    overlay,
    parts,
    slices,
)
from texvol.window.panels import medium as medium

WIDTH = round(PANEL_WIDTH)  # default width
_CONTROL = 0.56  # width of a control as a fraction of the panel's: the rest is for its label
_TAB_PADDING = (
    0.5  # of a button's padding: so that all tab names fit beside each other, with the dot of unsaved changes
)
BEHIND = (0.05, 0.05, 0.055)  # background without a picture

_TABS: dict[str, Callable[[Desk, Document], None]] = {
    "Medium": medium.show,
    "Scene": contents.show,
    "View": camera.show,
    "Light": light.show,
    "Cut": cut.show,
    "Slices": slices.show,
}
assert (*_TABS, "File") == TABS


def show(desk: Desk) -> None:
    """Show the side panel and the dialogs."""
    if desk.preferences.panels:
        _sidebar(desk)
    if desk.preferences.help:
        overlay.keys(desk)
    browser.show(desk)
    offer.show(desk)
    grips.drag(desk)
    if imgui.is_key_pressed(imgui.Key.escape):
        desk.preferences.help = False
        imgui.internal.close_popups_except_modals()


def over_picture(desk: Desk) -> None:
    """Draw the handles and the texts over the picture."""
    grips.draw(desk)
    slices.mark(desk)
    overlay.messages(desk)
    overlay.probed(desk)


def picture(texture: int, desk: Desk) -> None:
    """Draw the picture behind everything else."""
    imgui.get_background_draw_list().add_image(imgui.ImTextureRef(texture), *parts.corners(desk.viewport))


def _tab(name: str, desk: Desk) -> None:
    """Show the tab of that name."""
    if name == "File":
        files.show(desk)
    elif desk.document is None:
        imgui.text_disabled("No scene is open.")
    else:
        _TABS[name](desk, desk.document)


def _sidebar(desk: Desk) -> None:
    display = imgui.get_io().display_size
    left = desk.viewport.x + desk.viewport.width
    imgui.set_next_window_pos(imgui.ImVec2(left, 0))
    imgui.set_next_window_size(imgui.ImVec2(display.x - left, display.y))
    flags = (
        imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_bring_to_front_on_focus
    )
    style = imgui.get_style()
    rounding, style.window_rounding = style.window_rounding, 0.0
    imgui.begin("panels", None, flags)
    style.window_rounding = rounding
    edge.show(desk)
    status = overlay.status_height(desk)
    padding = imgui.ImVec2(_TAB_PADDING * style.frame_padding.x, style.frame_padding.y)
    imgui.push_style_var(imgui.StyleVar_.frame_padding, padding)
    begun = imgui.begin_tab_bar("tabs")
    imgui.pop_style_var()
    if begun:
        unsaved = desk.document is not None and desk.document.unsaved
        for name in TABS:
            # Integers, because imgui's enumeration has no member for "no flags".
            how = int(imgui.TabItemFlags_.set_selected) if desk.preferences.tab == name else 0
            how |= int(imgui.TabItemFlags_.unsaved_document) if name == "File" and unsaved else 0
            imgui.push_style_var(imgui.StyleVar_.frame_padding, padding)
            shown, _ = imgui.begin_tab_item(name, None, how)
            imgui.pop_style_var()
            if shown:
                imgui.begin_child("tab", imgui.ImVec2(0, -status))
                imgui.push_item_width(_CONTROL * imgui.get_content_region_avail().x)
                desk.panel_state["tab"] = name
                _tab(name, desk)
                imgui.pop_item_width()
                imgui.end_child()
                imgui.end_tab_item()
        imgui.end_tab_bar()
    overlay.status(desk)
    desk.preferences.tab = ""
    imgui.end()
