"""Contents of the window: the picture, texts and handles over it, and the side panel."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from imgui_bundle import imgui

from texvol.window import copying, motion
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
    ground,
    light,
    measure,
    measure_marks,
    medium,
    overlay,
    parts,
    planes,
    scrolling,
    slices,
    status,
    tiles,
    timebar,
    tips,
    writing,
)

_CONTROL = 0.56  # width of a control as a fraction of the panel's: the rest is for its label
# Of a button's padding, and of the usual spacing: all tab names fit beside each other, with the dot of unsaved changes.
_TAB_PADDING, _BETWEEN_TABS = 0.25, 0.2
_REACH = 8.0  # of the edge, window coordinates at scale 1: not wider than the panel's empty margin
_FLAGS = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_scroll_with_mouse
_FLAGS |= imgui.WindowFlags_.no_bring_to_front_on_focus
_EDGE, _HELD_EDGE = 0xFF_70_56_40, 0xFF_FF_B8_73  # ABGR

_TABS: dict[str, Callable[[Desk, Document], None]] = {
    "Medium": medium.show,
    "Scene": contents.show,
    "View": camera.show,
    "Light": light.show,
    "Cut": cut.show,
    "Slices": slices.show,
    "Measure": measure.show,
}
assert (*_TABS, "File") == TABS


def show(desk: Desk) -> None:
    """Show the side panel and the dialogs."""
    tiles.show(desk)
    tiles.switches(desk)
    if desk.preferences.panels:
        _sidebar(desk)
    if desk.preferences.help:
        overlay.keys(desk)
    empty.show(desk)
    timebar.show(desk)
    writing.show(desk)
    copying.update(desk)
    browser.browse(desk)
    dialogs.ask(desk)
    scrolling.drag(desk.panel_state)
    grips.drag(desk)
    cube.drag(desk)  # before marks are placed: a click on the cube is none on the picture
    measure_marks.act(desk)
    motion.step(desk)
    desk.moving.thumbnails.step(desk.document, desk.director)
    if imgui.is_key_pressed(imgui.Key.escape):
        desk.preferences.help = False
        imgui.internal.close_popups_except_modals()


def picture(desk: Desk) -> None:
    """Draw the picture behind everything else, with handles and texts over it."""
    shown = desk.director.shown
    ground.lay(desk)
    if shown is not None:
        corner = parts.corner_in_pixels(desk)
        desk.attempt(lambda: desk.annotating.draw(desk.textures, corner, desk.pixels, desk.director.pictures, shown))
    planes.draw(desk)  # first: slices would hide the grips
    grips.draw(desk)
    measure_marks.draw(desk)
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
    imgui.set_item_tooltip("drag: width of the panels; double click: the usual width")
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


@contextmanager
def _narrow_tabs() -> Iterator[None]:
    """Leave less room around the names of tabs, and between them."""
    style = imgui.get_style()
    padding = imgui.ImVec2(_TAB_PADDING * style.frame_padding.x, style.frame_padding.y)
    between = imgui.ImVec2(_BETWEEN_TABS * style.item_inner_spacing.x, style.item_inner_spacing.y)
    imgui.push_style_var(imgui.StyleVar_.frame_padding, padding)
    imgui.push_style_var(imgui.StyleVar_.item_inner_spacing, between)
    yield
    imgui.pop_style_var(2)


def _sidebar(desk: Desk) -> None:
    display = imgui.get_io().display_size
    left = desk.layout.area.x + desk.layout.area.width
    imgui.set_next_window_pos(imgui.ImVec2(left, 0))
    imgui.set_next_window_size(imgui.ImVec2(display.x - left, display.y))
    style = imgui.get_style()
    rounding, style.window_rounding = style.window_rounding, 0.0
    imgui.begin("panels", None, _FLAGS | imgui.WindowFlags_.no_background)  # the ground has it
    style.window_rounding = rounding
    _edge(desk)
    foot = status.height(desk)
    with _narrow_tabs():
        begun = imgui.begin_tab_bar("tabs")
    if begun:
        unsaved = desk.document is not None and desk.document.unsaved
        for name in TABS:
            # Integers, because imgui's enumeration has no member for "no flags".
            how = int(imgui.TabItemFlags_.set_selected) if desk.preferences.tab == name else 0
            how |= int(imgui.TabItemFlags_.unsaved_document) if name == "File" and unsaved else 0
            with _narrow_tabs():
                shown, _ = imgui.begin_tab_item(name, None, how)
            if shown:  # its tooltip would lie over the first controls
                _tab(name, desk, foot)
                imgui.end_tab_item()
            else:
                tips.show(name)
        imgui.end_tab_bar()
    status.show(desk)
    desk.preferences.tab = ""
    imgui.end()
