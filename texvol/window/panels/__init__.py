"""What is seen in the window: the picture, what is said of it, and the panels beside it."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import imgui

from texvol.window.commands import TABS
from texvol.window.desk import PANEL_WIDTH, Desk
from texvol.window.document import Document
from texvol.window.panels import browser, camera, contents, cut, edge, files, grips, light, offer, overlay, slices
from texvol.window.panels import medium as medium

WIDTH = round(PANEL_WIDTH)  # unless another is chosen
_CONTROL = 0.56  # of a panel's width: the rest is for what a control is called
_TAB_PADDING = 0.5  # of a button's: so all names and the dot of what is not saved have room beside each other
BEHIND = (0.05, 0.05, 0.055)  # where there is no picture

_TABS: dict[str, Callable[[Desk, Document], None]] = {
    "Matter": medium.show,
    "Scene": contents.show,
    "View": camera.show,
    "Light": light.show,
    "Cut": cut.show,
    "Slices": slices.show,
}
assert (*_TABS, "File") == TABS


def show(desk: Desk) -> None:
    """What there is to choose."""
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
    """What is drawn over the picture that is about to be shown, and said of it."""
    grips.draw(desk)
    slices.mark(desk)
    overlay.messages(desk)
    overlay.probed(desk)


def picture(texture: int, desk: Desk) -> None:
    """The picture, behind everything."""
    room = desk.room
    imgui.get_background_draw_list().add_image(
        imgui.ImTextureRef(texture),
        imgui.ImVec2(room.x, room.y),
        imgui.ImVec2(room.x + room.width, room.y + room.height),
    )


def _tab(name: str, desk: Desk) -> None:
    """What is in the tab of that name."""
    if name == "File":
        files.show(desk)
    elif desk.document is None:
        imgui.text_disabled("Nothing is open.")
    else:
        _TABS[name](desk, desk.document)


def _sidebar(desk: Desk) -> None:
    display = imgui.get_io().display_size
    left = desk.room.x + desk.room.width
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
            # Numbers of flags, since an enumeration has none for no flag at all.
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
