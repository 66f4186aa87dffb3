"""Measures drawn over slices, where points are placed by clicks and dragged in the plane of the slice."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui

from texvol.annotation.measures import ON_DARK, text_of
from texvol.window import measure_changes, measure_grips
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.measure_slices import Line, SliceMap, lines_of
from texvol.window.panels import measure_marks, parts
from texvol.window.panels.measure_letters import in_letters

_WIDTH, _HALO, _RADIUS, _REACH = 1.5, 3.5, 4.0, 9.0  # window coordinates at scale 1
_STILL = 6.0  # a press that moves farther is a drag from one point to the next
_THROUGH = 0.4  # opacity of what does not lie in the slice


def show(desk: Desk, document: Document, seen: SliceMap, name: str, *, hovered: bool) -> bool:
    """Draw the measures over a slice of that name, and process clicks; return True if the mouse is a measure's.

    The clip rectangle of the window's draw list must be that of the slice.
    """
    used = _act(desk, document, seen, name, hovered)
    drawn = imgui.get_window_draw_list()
    line, _, halo = measure_marks.colors((0.0, 0.0, 0.0))
    through = imgui.color_convert_float4_to_u32(imgui.ImVec4(*ON_DARK, _THROUGH))
    scale = parts.scale()
    for each in document.measures:
        lines = lines_of(each, seen) if each.shown else []
        for stroke in lines:
            start, end = imgui.ImVec2(*stroke.start.tolist()), imgui.ImVec2(*stroke.end.tolist())
            if stroke.inside:
                drawn.add_line(start, end, halo, _HALO * scale)
            drawn.add_line(start, end, line if stroke.inside else through, _WIDTH * scale)
        if lines and any(stroke.inside for stroke in lines):
            _text(drawn, lines, in_letters(text_of(each, document.scene.volume.unit)), (line, halo))
    for grip in measure_grips.grips_of(document.measures, None):
        if seen.holds(np.array(grip.at)) and grip.point is not None:
            spot = imgui.ImVec2(*seen.positions(np.array([grip.at]))[0].tolist())
            drawn.add_circle_filled(spot, (_RADIUS + 1) * scale, halo)
            drawn.add_circle_filled(spot, _RADIUS * scale, line)
    for point in desk.measuring.placed:
        if seen.holds(np.array(point)):
            drawn.add_circle_filled(imgui.ImVec2(*seen.positions(np.array([point]))[0].tolist()), 4 * scale, line)
    return used


def _text(drawn: imgui.ImDrawList, lines: list[Line], words: str, shades: tuple[int, int]) -> None:
    """Write a value beside the end of its lines that is lowest in the slice."""
    ends = np.array([point for line in lines for point in (line.start, line.end)])
    lowest = ends[int(ends[:, 1].argmax())]
    extent, scale = imgui.calc_text_size(words), parts.scale()
    first, last = drawn.get_clip_rect_min(), drawn.get_clip_rect_max()
    x = max(min(float(lowest[0]) - extent.x / 2, last.x - extent.x - 3 * scale), first.x + 3 * scale)
    y = max(min(float(lowest[1]) + 6 * scale, last.y - extent.y - 3 * scale), first.y + 3 * scale)
    measure_marks.text(drawn, (round(x), round(y)), words, shades, imgui.get_font_size())


def _act(desk: Desk, document: Document, seen: SliceMap, name: str, hovered: bool) -> bool:
    """Place points, and start, continue or end the drag of a point; return True if the mouse is used for that."""
    io, state = imgui.get_io(), desk.panel_state
    mouse = io.mouse_pos
    if desk.measuring.tool and hovered and imgui.is_mouse_clicked(0):
        measure_changes.place(desk, seen.point(mouse.x, mouse.y))
        state["measure in slice"] = name, None, (mouse.x, mouse.y)
        return True
    held = state.get("measure in slice")
    if held is not None and held[0] == name:
        _, number, point = held
        if not io.mouse_down[0]:
            state["measure in slice"] = None
            if number is None and np.hypot(mouse.x - point[0], mouse.y - point[1]) > _STILL * parts.scale():
                measure_changes.place(desk, seen.point(mouse.x, mouse.y))  # the next point, at the end of a drag
            return True
        if number is not None and number < len(document.measures):
            each = document.measures[number]
            if io.mouse_delta.x or io.mouse_delta.y:
                moved = each.moved(point, seen.point(mouse.x, mouse.y))
                measure_changes.replaced(desk, number, moved, "measure in slice")
        return True
    if not (hovered and imgui.is_mouse_clicked(0)) or desk.measuring.tool:
        return False
    for grip in measure_grips.grips_of(document.measures, None):
        if grip.point is None or not seen.holds(np.array(grip.at)):
            continue
        x, y = seen.positions(np.array([grip.at]))[0]
        if np.hypot(x - mouse.x, y - mouse.y) < _REACH * parts.scale():
            desk.measuring.selected = grip.measure
            state["measure in slice"] = name, grip.measure, grip.point
            return True
    return False
