"""Edge between the picture and the side panel: a drag changes the panel's width, a double click resets it."""

from __future__ import annotations

from imgui_bundle import imgui

from texvol.window.desk import NARROWEST_PANEL, PANEL_WIDTH, WIDEST_PANEL, Desk
from texvol.window.panels import parts

_REACH = 8.0  # window coordinates at scale 1: not wider than the panel's empty margin
_LINE, _HELD = 0xFF_70_56_40, 0xFF_FF_B8_73  # ABGR


def show(desk: Desk) -> None:
    """Show the edge at the left of the current window, which is the side panel."""
    scale = parts.scale()
    start, corner = imgui.get_window_pos(), imgui.get_cursor_pos()
    height = imgui.get_window_size().y
    imgui.set_cursor_screen_pos(start)
    imgui.invisible_button("edge", imgui.ImVec2(_REACH * scale, max(height, 1.0)))
    held, over = imgui.is_item_active(), imgui.is_item_hovered()
    if held or over:
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
        end = imgui.ImVec2(start.x + (3 if held else 2) * scale, start.y + height)
        imgui.get_window_draw_list().add_rect_filled(start, end, _HELD if held else _LINE)
    if over and imgui.is_mouse_double_clicked(0):
        desk.preferences.width = PANEL_WIDTH
    elif held and imgui.is_mouse_dragging(0, 1.0):
        wanted = imgui.get_io().display_size.x - imgui.get_io().mouse_pos.x
        desk.preferences.width = min(max(wanted / scale, NARROWEST_PANEL), WIDEST_PANEL)
    imgui.set_cursor_pos(corner)
