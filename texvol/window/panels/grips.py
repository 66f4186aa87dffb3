"""Crop box and clip planes in the picture, with grips to drag them by, while the tab about cutting is open."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from imgui_bundle import imgui

from texvol.window import handles
from texvol.window.desk import Desk
from texvol.window.handles import Handle
from texvol.window.navigation import Position

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
        one, other = handles.position_of(camera, start), handles.position_of(camera, end)
        if one is not None and other is not None:
            drawn.add_line(_point(desk, one), _point(desk, other), _LINE, 1.5)
    over, grips = desk.panel_state.get("over"), _grips(desk)
    for (foot, foot_position), (tip, tip_position) in pairwise(grips):
        if tip.turns and foot.plane == tip.plane:
            drawn.add_line(_point(desk, foot_position), _point(desk, tip_position), _TURNS, 2.0)
    for number, (handle, position) in enumerate(grips):
        color = _HELD if number == over else _TURNS if handle.turns else _GRIP
        drawn.add_circle_filled(_point(desk, position), _RADIUS, color)
    drawn.pop_clip_rect()


def _shows(desk: Desk) -> bool:
    return desk.document is not None and desk.panel_state.get("tab") == "Cut" and desk.preferences.panels


def _grips(desk: Desk) -> list[tuple[Handle, Position]]:
    """Handles in front of the eye, and where they are in the picture."""
    assert desk.document is not None
    camera = desk.document.view.camera
    found: list[tuple[Handle, Position]] = []
    for each in handles.handles_of(desk.document.scene):
        position = handles.position_of(camera, np.array(each.point))
        if position is None:
            continue
        foot = found[-1] if found else None
        if each.turns and foot is not None and foot[0].plane == each.plane:
            position = _apart(foot[1], position, 2 * _APART / max(desk.room.height, 1))
        found.append((each, position))
    return found


def _apart(foot: Position, tip: Position, least: float) -> Position:
    """The tip in its direction from the foot, at least so far from it."""
    ray = np.subtract(tip, foot)
    length = float(np.linalg.norm(ray))
    if length >= least:
        return tip
    ray = ray / length if length > 1e-3 * least else np.array((0.6, 0.8))
    return float(foot[0] + least * ray[0]), float(foot[1] + least * ray[1])


def _drag(desk: Desk, grips: list[tuple[Handle, Position]]) -> int | None:
    """Take hold, move, let go; the number of the grip that is held or pointed at."""
    io, state, document = imgui.get_io(), desk.panel_state, desk.document
    assert document is not None
    mouse = io.mouse_pos
    held = state.get("grip")
    if held is not None and (not io.mouse_down[0] or held >= len(grips)):
        held = state["grip"] = None
    if held is not None:
        handle, _ = grips[held]
        now, before = desk.room.position(mouse.x, mouse.y), state["gripped at"]
        by = now[0] - before[0], now[1] - before[1]
        _pull(desk, handle, by)
        state["gripped at"] = now
        desk.gripping = True
        return int(held)
    if io.want_capture_mouse or desk.steering.dragging or not desk.room.holds(mouse.x, mouse.y):
        return None
    for number, (handle, position) in enumerate(grips):
        at = _point(desk, position)
        if np.hypot(at.x - mouse.x, at.y - mouse.y) < _REACH:
            desk.gripping = True
            if imgui.is_mouse_clicked(0):
                state["grip"], state["gripped at"] = number, desk.room.position(mouse.x, mouse.y)
                state["grip away"] = handles.points_away(handle, document.view.camera)
            return number
    return None


def _pull(desk: Desk, handle: Handle, by: Position) -> None:
    """Move a handle, or turn what it turns."""
    document = desk.document
    assert document is not None
    scene, camera = document.scene, document.view.camera
    if handle.turns:
        if any(by):
            away = bool(desk.panel_state.get("grip away"))
            desk.change("grip", **handles.turned(scene, handle, camera, by, away=away))
        return
    ray = handles.ray_of(handle, camera, by, scene.box.radius)
    if ray:
        desk.change("grip", **handles.moved(scene, handle, ray))


def _point(desk: Desk, position: Position) -> imgui.ImVec2:
    room = desk.room
    half = room.height / 2
    return imgui.ImVec2(room.x + room.width / 2 + position[0] * half, room.y + half - position[1] * half)
