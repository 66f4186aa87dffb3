"""Crop box and clip planes in the picture, with grips to drag them by, while the tab about cutting is open."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from imgui_bundle import imgui

from texvol.window import handles
from texvol.window.desk import Desk
from texvol.window.handles import Handle
from texvol.window.navigation import Place

_LINE, _GRIP, _HELD = 0xA0_50_B8_FF, 0xFF_50_B8_FF, 0xFF_FF_FF_FF  # ABGR: amber, and white
_TURNS = 0xFF_FF_C8_78  # light blue
_RADIUS, _REACH = 6.0, 12.0  # window coordinates
_APART = 30.0  # at least, of an arrow's tip and its foot: else one could not take the one that is wanted


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
    over, grips = desk.panel_state.get("over"), _grips(desk)
    for (foot, foot_place), (tip, tip_place) in pairwise(grips):
        if tip.turns and foot.plane == tip.plane:
            drawn.add_line(_point(desk, foot_place), _point(desk, tip_place), _TURNS, 2.0)
    for number, (handle, place) in enumerate(grips):
        color = _HELD if number == over else _TURNS if handle.turns else _GRIP
        drawn.add_circle_filled(_point(desk, place), _RADIUS, color)
    drawn.pop_clip_rect()


def _shows(desk: Desk) -> bool:
    return desk.document is not None and desk.panel_state.get("tab") == "Cut" and desk.preferences.panels


def _grips(desk: Desk) -> list[tuple[Handle, Place]]:
    """Handles in front of the eye, and where they are in the picture."""
    assert desk.document is not None
    camera = desk.document.view.camera
    found: list[tuple[Handle, Place]] = []
    for each in handles.handles_of(desk.document.scene):
        place = handles.place_of(camera, np.array(each.point))
        if place is None:
            continue
        foot = found[-1] if found else None
        if each.turns and foot is not None and foot[0].plane == each.plane:
            place = _apart(foot[1], place, 2 * _APART / max(desk.room.height, 1))
        found.append((each, place))
    return found


def _apart(foot: Place, tip: Place, least: float) -> Place:
    """The tip in its direction from the foot, at least so far from it."""
    way = np.subtract(tip, foot)
    length = float(np.linalg.norm(way))
    if length >= least:
        return tip
    way = way / length if length > 1e-3 * least else np.array((0.6, 0.8))
    return float(foot[0] + least * way[0]), float(foot[1] + least * way[1])


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
        _pull(desk, handle, by)
        state["gripped at"] = now
        desk.gripping = True
        return int(held)
    if io.want_capture_mouse or desk.steering.dragging or not desk.room.holds(mouse.x, mouse.y):
        return None
    for number, (handle, place) in enumerate(grips):
        at = _point(desk, place)
        if np.hypot(at.x - mouse.x, at.y - mouse.y) < _REACH:
            desk.gripping = True
            if imgui.is_mouse_clicked(0):
                state["grip"], state["gripped at"] = number, desk.room.place(mouse.x, mouse.y)
                state["grip away"] = handles.points_away(handle, document.view.camera)
            return number
    return None


def _pull(desk: Desk, handle: Handle, by: Place) -> None:
    """Move a handle, or turn what it turns."""
    document = desk.document
    assert document is not None
    scene, camera = document.scene, document.view.camera
    if handle.turns:
        if any(by):
            away = bool(desk.panel_state.get("grip away"))
            desk.change("grip", **handles.turned(scene, handle, camera, by, away=away))
        return
    way = handles.way_of(handle, camera, by, scene.box.radius)
    if way:
        desk.change("grip", **handles.moved(scene, handle, way))


def _point(desk: Desk, place: Place) -> imgui.ImVec2:
    room = desk.room
    half = room.height / 2
    return imgui.ImVec2(room.x + room.width / 2 + place[0] * half, room.y + half - place[1] * half)
