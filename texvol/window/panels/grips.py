"""Crop box and clip planes in the picture, with grips to drag them by, while the tab about cutting is open."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui

from texvol.window import handles
from texvol.window.desk import Desk
from texvol.window.handles import Handle
from texvol.window.navigation import Place

_LINE, _GRIP, _HELD = 0xA0_50_B8_FF, 0xFF_50_B8_FF, 0xFF_FF_FF_FF  # ABGR: amber, and white
_RADIUS, _REACH = 6.0, 12.0  # window coordinates


def drag(desk: Desk) -> None:
    """Take hold of a grip, move it, let it go."""
    desk.gripping = False
    if _shows(desk):
        desk.panel_state["over"] = _drag(desk, _grips(desk))


def draw(desk: Desk) -> None:
    """Lines and grips, over the picture."""
    document = desk.document
    if document is None or not _shows(desk):
        return
    camera, room = document.view.camera, desk.room
    drawn = imgui.get_background_draw_list()
    drawn.push_clip_rect(imgui.ImVec2(room.x, room.y), imgui.ImVec2(room.x + room.width, room.y + room.height))
    for start, end in handles.outline(document.scene):
        one, other = handles.place_of(camera, start), handles.place_of(camera, end)
        if one is not None and other is not None:
            drawn.add_line(_point(desk, one), _point(desk, other), _LINE, 1.5)
    over = desk.panel_state.get("over")
    for number, (_, place) in enumerate(_grips(desk)):
        drawn.add_circle_filled(_point(desk, place), _RADIUS, _HELD if number == over else _GRIP)
    drawn.pop_clip_rect()


def _shows(desk: Desk) -> bool:
    return desk.document is not None and desk.panel_state.get("tab") == "Cut" and desk.preferences.panels


def _grips(desk: Desk) -> list[tuple[Handle, Place]]:
    """Handles in front of the eye, and where they are in the picture."""
    assert desk.document is not None
    camera = desk.document.view.camera
    every = [(each, handles.place_of(camera, np.array(each.point))) for each in handles.handles_of(desk.document.scene)]
    return [(each, place) for each, place in every if place is not None]


def _drag(desk: Desk, grips: list[tuple[Handle, Place]]) -> int | None:
    """Take hold, move, let go; the number of the grip that is held or pointed at."""
    io, state, document = imgui.get_io(), desk.panel_state, desk.document
    assert document is not None
    mouse = io.mouse_pos
    held = state.get("grip")
    if held is not None and (not io.mouse_down[0] or held >= len(grips)):
        held = state["grip"] = None
    if held is not None:
        handle, _ = grips[held]
        now, before = desk.room.place(mouse.x, mouse.y), state["gripped at"]
        by = now[0] - before[0], now[1] - before[1]
        way = handles.way_of(handle, document.view.camera, by, document.scene.box.radius)
        if way:
            desk.change("grip", **handles.moved(document.scene, handle, way))
        state["gripped at"] = now
        desk.gripping = True
        return int(held)
    if io.want_capture_mouse or desk.steering.dragging or not desk.room.holds(mouse.x, mouse.y):
        return None
    for number, (_, place) in enumerate(grips):
        at = _point(desk, place)
        if np.hypot(at.x - mouse.x, at.y - mouse.y) < _REACH:
            desk.gripping = True
            if imgui.is_mouse_clicked(0):
                state["grip"], state["gripped at"] = number, desk.room.place(mouse.x, mouse.y)
            return number
    return None


def _point(desk: Desk, place: Place) -> imgui.ImVec2:
    room = desk.room
    half = room.height / 2
    return imgui.ImVec2(room.x + room.width / 2 + place[0] * half, room.y + half - place[1] * half)
