"""Contents of the window: the picture, texts and handles over it, and the side panel."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import imgui

from texvol.window import motion
from texvol.window.commands import TABS
from texvol.window.desk import NARROWEST_PANEL, PANEL_WIDTH, WIDEST_PANEL, Desk
from texvol.window.document import Document
from texvol.window.panels import (
    browser,
    camera,
    contents,
    cube,
    cut,
    dialogs,
    empty,
    files,
    grips,
    light,
    medium,
    overlay,
    parts,
    slices,
)

_CONTROL = 0.56  # width of a control as a fraction of the panel's: the rest is for its label
_TAB_PADDING = 0.5  # of a button's: all tab names fit beside each other, with the dot of unsaved changes
BEHIND = (0.05, 0.05, 0.055)  # background without a picture
_REACH = 8.0  # of the edge, window coordinates at scale 1: not wider than the panel's empty margin
_EDGE, _HELD_EDGE = 0xFF_70_56_40, 0xFF_FF_B8_73  # ABGR

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
    empty.show(desk)
    browser.browse(desk)
    dialogs.ask(desk)
    grips.drag(desk)
    cube.drag(desk)
    motion.step(desk)
    desk.moving.thumbnails.step(desk.document, desk.director)
    if imgui.is_key_pressed(imgui.Key.escape):
        desk.preferences.help = False
        imgui.internal.close_popups_except_modals()


def picture(desk: Desk) -> None:
    """Draw the picture behind everything else, with handles and texts over it."""
    shown = desk.director.shown
    if shown is not None and desk.textures is not None:
        texture = imgui.ImTextureRef(desk.textures.get("picture", desk.director.pictures, lambda: shown.pixels))
        imgui.get_background_draw_list().add_image(texture, *parts.corners(desk.viewport))
    grips.draw(desk)
    cube.draw(desk)
    slices.mark(desk)
    overlay.messages(desk)
    overlay.probed(desk)


def _tab(name: str, desk: Desk, foot: float) -> None:
    """Show the tab of that name, above a foot of that height."""
    imgui.begin_child("tab", imgui.ImVec2(0, -foot))
    imgui.push_item_width(_CONTROL * imgui.get_content_region_avail().x)
    desk.panel_state["tab"] = name
    if name == "File":
        files.show(desk)
    elif desk.document is None:
        imgui.text_disabled("No scene is open.")
    else:
        _TABS[name](desk, desk.document)
    imgui.pop_item_width()
    imgui.end_child()


def _edge(desk: Desk) -> None:
    """Show the edge between picture and panels; a drag changes the panels' width, a double click resets it."""
    scale = parts.scale()
    start, corner = imgui.get_window_pos(), imgui.get_cursor_pos()
    height = imgui.get_window_size().y
    imgui.set_cursor_screen_pos(start)
    imgui.invisible_button("edge", imgui.ImVec2(_REACH * scale, max(height, 1.0)))
    held, over = imgui.is_item_active(), imgui.is_item_hovered()
    if held or over:
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
        end = imgui.ImVec2(start.x + (3 if held else 2) * scale, start.y + height)
        imgui.get_window_draw_list().add_rect_filled(start, end, _HELD_EDGE if held else _EDGE)
    if over and imgui.is_mouse_double_clicked(0):
        desk.preferences.width = PANEL_WIDTH
    elif held and imgui.is_mouse_dragging(0, 1.0):
        wanted = imgui.get_io().display_size.x - imgui.get_io().mouse_pos.x
        desk.preferences.width = min(max(wanted / scale, NARROWEST_PANEL), WIDEST_PANEL)
    imgui.set_cursor_pos(corner)


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
    _edge(desk)
    lines = overlay.status_lines(desk)
    status = overlay.status_height(desk, lines)
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
                _tab(name, desk, status)
                imgui.end_tab_item()
        imgui.end_tab_bar()
    if lines:
        imgui.separator()
        for line in lines:
            imgui.text_wrapped(line)
    desk.preferences.tab = ""
    imgui.end()
