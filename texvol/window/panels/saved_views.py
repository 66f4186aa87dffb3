"""Saved views of the View tab: a list with small pictures, and the path of a film through them."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from imgui_bundle import imgui

from texvol.scene.tour import LONGEST_SECONDS, SavedView
from texvol.window import motion, saved_views
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.naming import shortened
from texvol.window.panels import parts

_WIDTH, _HEIGHT = 80.0, 50.0  # of a small picture, window coordinates at scale 1
_EMPTY, _HERE = 0xFF_30_2C_2A, 0xFF_FF_B8_73  # ABGR
_LONGEST_NAME = 60
_LONGEST_STEP = 24  # letters of a label


def show(desk: Desk, document: Document) -> None:
    """Show the list of saved views."""
    imgui.separator_text("Saved views")
    if imgui.button("save this view", imgui.ImVec2(-1, 0)):
        saved_views.save(desk, document)
    imgui.set_item_tooltip("keep the camera as it is now, in the scene and its file (v)")
    for number, view in enumerate(document.tour.views):
        imgui.push_id(f"view {number}")
        _row(desk, document, number, view)
        imgui.pop_id()
    if len(document.tour.views) > 1:
        _path(desk, document)


def _row(desk: Desk, document: Document, number: int, view: SavedView) -> None:
    """Show one view: its picture, its name, and what can be done with it."""
    here = view.camera == document.view.camera
    if _picture(desk, number, view, here=here):
        saved_views.go(desk, document, number)
    imgui.set_item_tooltip("go there")
    imgui.same_line()
    imgui.begin_group()
    imgui.set_next_item_width(-1)
    entered, name = imgui.input_text("##name", view.name)
    imgui.set_item_tooltip("name of the view")
    if entered and name.strip():
        desk.attempt(lambda: saved_views.change(document, number, f"name {number}", name=name[:_LONGEST_NAME]))
    _buttons(desk, document, number, here=here)
    imgui.end_group()


def _picture(desk: Desk, number: int, view: SavedView, *, here: bool) -> bool:
    """Show the small picture of a view; return True if it is clicked."""
    scale = parts.scale()
    corner, size = imgui.get_cursor_screen_pos(), imgui.ImVec2(_WIDTH * scale, _HEIGHT * scale)
    clicked = imgui.invisible_button("picture", size)
    end, drawn = imgui.ImVec2(corner.x + size.x, corner.y + size.y), imgui.get_window_draw_list()
    known = desk.moving.thumbnails.get(view)
    if known is None or desk.textures is None:
        drawn.add_rect_filled(corner, end, _EMPTY)
    else:
        texture = desk.textures.get(f"view {number}", known.version, lambda: known.pixels)
        drawn.add_image(imgui.ImTextureRef(texture), corner, end)
    if here or imgui.is_item_hovered():
        drawn.add_rect(corner, end, _HERE, 0.0, 2.0 * scale)
    return bool(clicked)


def _buttons(desk: Desk, document: Document, number: int, *, here: bool) -> None:
    count = len(document.tour.views)
    imgui.begin_disabled(here)
    if imgui.button("update"):
        saved_views.update(desk, document, number)
    imgui.end_disabled()
    imgui.set_item_tooltip("take the camera as it is now")
    for label, to, text in (("up", number - 1, "earlier in the list"), ("down", number + 1, "later in the list")):
        imgui.same_line()
        imgui.begin_disabled(not 0 <= to < count)
        if imgui.button(label):
            saved_views.move(document, number, to)
        imgui.end_disabled()
        imgui.set_item_tooltip(text)
    imgui.same_line()
    if imgui.button("delete"):
        saved_views.delete(document, number)
    imgui.set_item_tooltip("take this view out of the list (undo: ctrl-z)")


def _path(desk: Desk, document: Document) -> None:
    """Show how a film goes through the views."""
    imgui.spacing()
    imgui.text("Path through the views")
    tour = document.tour
    _seconds(desk, document)
    closed = parts.switch("back to the first", tour.closed)
    imgui.same_line(imgui.get_content_region_avail().x / 2)
    stops = parts.switch("stop at each", tour.stops)
    document.change_tour(replace(document.tour, closed=closed, stops=stops))
    preview(desk, document)


def _seconds(desk: Desk, document: Document) -> None:
    """Show the time of each step of the path."""
    tour = document.tour
    views = tour.views if tour.closed else tour.views[:-1]
    for number, view in enumerate(views):
        following = tour.views[(number + 1) % len(tour.views)]
        imgui.push_id(f"step {number}")
        label = shortened(f"{view.name} to {following.name}", _LONGEST_STEP)
        changed, seconds = imgui.drag_float(label, view.seconds, 0.02, 0.1, LONGEST_SECONDS, "%.2g s")
        imgui.set_item_tooltip(f"time from {view.name} to {following.name}; drag, or double-click to type")
        if changed and 0 < seconds <= LONGEST_SECONDS:
            desk.attempt(partial(saved_views.change, document, number, f"seconds {number}", seconds=seconds))
        imgui.pop_id()


def preview(desk: Desk, document: Document) -> None:
    """Show the button that plays the path in the window, or stops that."""
    moving = desk.moving.motion
    if moving is not None and moving.name:
        if imgui.button("stop the preview", imgui.ImVec2(-1, 0)):
            motion.stop(desk)
        imgui.set_item_tooltip("stay where the camera is now")
        return
    if imgui.button(f"preview of {document.tour.seconds:.3g} s", imgui.ImVec2(-1, 0)):
        desk.attempt(lambda: motion.preview(desk, document, document.tour))
    imgui.set_item_tooltip("go through the views here; the film of it is in the File tab")
