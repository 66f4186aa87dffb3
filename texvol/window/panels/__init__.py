"""What is seen in the window: the picture, what is said of it, and the panels beside it."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import imgui

from texvol.window.desk import Desk
from texvol.window.panels import browser, camera, cut, files, grips, light, matter, overlay, slices

WIDTH = 360  # window coordinates at scale 1
_CONTROL = 0.56  # of a panel's width: the rest is for what a control is called
BEHIND = (0.05, 0.05, 0.055)  # where there is no picture

_TABS: tuple[tuple[str, Callable[[Desk], None]], ...] = (
    ("Matter", matter.show),
    ("View", camera.show),
    ("Light", light.show),
    ("Cut", cut.show),
    ("Slices", slices.show),
    ("File", files.show),
)


def show(desk: Desk) -> None:
    """What there is to choose."""
    if desk.preferences.panels:
        _sidebar(desk)
    if desk.preferences.help:
        overlay.keys(desk)
    browser.show(desk)
    grips.drag(desk)
    if imgui.is_key_pressed(imgui.Key.escape):
        desk.preferences.help = False
        imgui.internal.close_popups_except_modals()


def over_picture(desk: Desk) -> None:
    """What is drawn over the picture that is about to be shown, and said of it."""
    grips.draw(desk)
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
    status = overlay.status_height(desk)
    if imgui.begin_tab_bar("tabs"):
        for name, draw in _TABS:
            wanted = desk.preferences.tab == name
            shown, _ = imgui.begin_tab_item(name, None, imgui.TabItemFlags_.set_selected if wanted else 0)
            if shown:
                imgui.begin_child("tab", imgui.ImVec2(0, -status))
                imgui.push_item_width(_CONTROL * imgui.get_content_region_avail().x)
                desk.panel_state["tab"] = name
                draw(desk)
                imgui.pop_item_width()
                imgui.end_child()
                imgui.end_tab_item()
        imgui.end_tab_bar()
    overlay.status(desk)
    desk.preferences.tab = ""
    imgui.end()
