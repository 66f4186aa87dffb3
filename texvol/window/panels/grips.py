"""Crop box and clip planes in the picture, with handles to drag them; shown while the Cut tab is open."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from imgui_bundle import imgui

from texvol.window import handles
from texvol.window.desk import Desk
from texvol.window.handles import Handle
from texvol.window.navigation import Position
from texvol.window.panels import parts

# Colours are ABGR. Grips of faces have that of their axis: x, y, z.
_LINE, HELD, BORDER = 0xA0_D8_D8_D8, 0xFF_FF_FF_FF, 0xE0_10_10_10
OF_AXIS = (0xFF_5A_5A_F5, 0xFF_5A_C8_5A, 0xFF_FF_96_50)
_PLANE, _TURNS = 0xFF_50_B8_FF, 0xFF_FF_E0_A0  # amber; a plane's arrow is light blue
_RADIUS, _REACH = 6.0, 12.0  # window coordinates at scale 1, as are the next three
_RING, _AROUND = 2.0, 1.5  # widths of a hollow grip's ring, and of the dark outline
_APART = 30.0  # least distance of an arrow's tip from its foot, so that each can be picked


def drag(desk: Desk) -> None:
    """Process the drag of a handle."""
    desk.gripping = False
    if _shows(desk):
        desk.panel_state["over"] = _drag(desk, _grips(desk))


def draw(desk: Desk) -> None:
    """Draw outlines and handles over the picture."""
    document = desk.document
    if document is None or not _shows(desk):
        return
    camera, box = document.view.camera, document.scene.box
    drawn = imgui.get_background_draw_list()
    drawn.push_clip_rect(*parts.corners(desk.viewport))
    for start, end in handles.outline(document.scene):
        one, other = handles.position_of(camera, start), handles.position_of(camera, end)
        if one is not None and other is not None:
            drawn.add_line(_point(desk, one), _point(desk, other), _LINE, 1.5 * parts.scale())
    over, grips = desk.panel_state.get("over"), _grips(desk)
    for (foot, foot_position), (tip, tip_position) in pairwise(grips):
        if tip.turns and foot.plane == tip.plane:
            drawn.add_line(_point(desk, foot_position), _point(desk, tip_position), _TURNS, 2.0 * parts.scale())
    for number, (handle, position) in enumerate(grips):
        color = HELD if number == over else _color(handle)
        grip(drawn, _point(desk, position), color, handles.is_behind(handle.point, camera, box.centre, box.radius))
    drawn.pop_clip_rect()


def _color(handle: Handle) -> int:
    if handle.face is not None:
        return OF_AXIS[handle.face[0]]
    return _TURNS if handle.turns else _PLANE


def grip(drawn: imgui.ImDrawList, at: imgui.ImVec2, color: int, hollow: bool, border: int = BORDER) -> None:
    """Draw a grip with an outline, which shows on any background; a hollow one is a ring."""
    scale = parts.scale()
    radius, ring, around = (each * scale for each in (_RADIUS, _RING, _AROUND))
    if hollow:
        middle = radius - ring / 2
        drawn.add_circle(at, middle, border, 0, ring + 2 * around)
        drawn.add_circle(at, middle, color, 0, ring)
    else:
        drawn.add_circle_filled(at, radius + around, border)
        drawn.add_circle_filled(at, radius, color)


def _shows(desk: Desk) -> bool:
    return desk.document is not None and desk.panel_state.get("tab") == "Cut" and desk.preferences.panels


def _grips(desk: Desk) -> list[tuple[Handle, Position]]:
    """Return the handles in front of the eye, with their positions in the picture."""
    assert desk.document is not None
    camera = desk.document.view.camera
    found: list[tuple[Handle, Position]] = []
    for each in handles.handles_of(desk.document.scene):
        position = handles.position_of(camera, np.array(each.point))
        if position is None:
            continue
        foot = found[-1] if found else None
        if each.turns and foot is not None and foot[0].plane == each.plane:
            position = _apart(foot[1], position, 2 * _APART * parts.scale() / max(desk.viewport.height, 1))
        found.append((each, position))
    return found


def _apart(foot: Position, tip: Position, least: float) -> Position:
    """Return the tip, moved away from the foot to at least a distance `least`."""
    arrow = np.subtract(tip, foot)
    length = float(np.linalg.norm(arrow))
    if length >= least:
        return tip
    arrow = arrow / length if length > 1e-3 * least else np.array((0.6, 0.8))
    return float(foot[0] + least * arrow[0]), float(foot[1] + least * arrow[1])


def _drag(desk: Desk, grips: list[tuple[Handle, Position]]) -> int | None:
    """Start, continue or end a drag; return the number of the handle that is dragged or under the mouse."""
    io, state, document = imgui.get_io(), desk.panel_state, desk.document
    assert document is not None
    mouse = io.mouse_pos
    now = desk.viewport.position(mouse.x, mouse.y)
    held = state.get("grip")
    if held is not None and (not io.mouse_down[0] or held >= len(grips)):
        held = state["grip"] = None
    if held is not None:
        before, state["gripped at"] = state["gripped at"], now
        _pull(desk, grips[held][0], (now[0] - before[0], now[1] - before[1]))
        desk.gripping = True
        return int(held)
    if io.want_capture_mouse or desk.steering.dragging or not desk.viewport.holds(mouse.x, mouse.y):
        return None
    for number, (handle, position) in enumerate(grips):
        at = _point(desk, position)
        if np.hypot(at.x - mouse.x, at.y - mouse.y) < _REACH * parts.scale():
            desk.gripping = True
            if imgui.is_mouse_clicked(0):
                state["grip"], state["gripped at"] = number, now
                state["grip away"] = handles.points_away(handle, document.view.camera)
            return number
    return None


def _pull(desk: Desk, handle: Handle, by: Position) -> None:
    """Move a handle, or turn its plane."""
    document = desk.document
    assert document is not None
    scene, camera = document.scene, document.view.camera
    if not any(by):
        return
    if handle.turns:
        away = bool(desk.panel_state.get("grip away"))
        desk.change("grip", **handles.turned(scene, handle, camera, by, away=away))
    elif distance := handles.drag_distance(handle, camera, by, scene.box.radius):
        desk.change("grip", **handles.moved(scene, handle, distance))


def _point(desk: Desk, position: Position) -> imgui.ImVec2:
    return imgui.ImVec2(*desk.viewport.point(position))
