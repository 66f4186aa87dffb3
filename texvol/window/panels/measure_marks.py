"""Measures over the picture: lines and values at the window's resolution, grips, and clicks that place points."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from imgui_bundle import imgui

from texvol.annotation.measures import FAINT, Marks, color_on, marks_of, placed_texts
from texvol.annotation.view import View
from texvol.util.color import srgb_from_linear
from texvol.window import measure_changes, measure_grips, probe
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.handles import position_of
from texvol.window.measure_grips import Grip
from texvol.window.navigation import Position, triple
from texvol.window.panels import grips, parts
from texvol.window.panels.measure_letters import in_letters

_EM = 1 / 40  # of the picture's height: size of the values, as in pictures that are written
_LEAST_EM = 15.0  # window coordinates at scale 1, as are the following
_WIDTH, _HALO = 1.6, 4.0  # of a line, and of the dark or light line around it
_HALO_OPACITY = 0.75
_RADIUS, _REACH = 5.0, 11.0  # of a grip, and of the mouse around it
_STILL = 4.0  # a press that moves farther turns the view, and places no point
_FOOT = 40.0  # of the hint above the lower edge of the picture


def active(desk: Desk) -> bool:
    """True while measures have grips: while the Measure tab is open, or a tool is in hand."""
    if desk.document is None:
        return False
    return bool(desk.measuring.tool) or (desk.panel_state.get("tab") == "Measure" and desk.preferences.panels)


def act(desk: Desk) -> None:
    """Process clicks that place points, and drags of grips."""
    measure_changes.update(desk)
    document, state = desk.document, desk.panel_state
    if document is None or not active(desk):
        state["measure grip"] = None
        return
    if desk.measuring.tool:
        state["measure grip"] = None
        _place(desk, document)
        if imgui.is_key_pressed(imgui.Key.escape):
            measure_changes.take(desk, "")
    else:
        _drag(desk, document)


def draw(desk: Desk) -> None:
    """Draw all measures that are shown, grips, and the line that follows the mouse."""
    document = desk.document
    if document is None:
        return
    drawn = imgui.get_background_draw_list()
    drawn.push_clip_rect(*parts.corners(desk.viewport))
    _measures(desk, document, drawn)
    if active(desk):
        _grips(desk, document, drawn)
        _profiled(desk, document, drawn)
    if desk.measuring.tool:
        _preview(desk, document, drawn)
        _hint(desk, drawn)
    drawn.pop_clip_rect()


def colors(background: tuple[float, float, float]) -> tuple[int, int, int]:
    """Return the colours of lines, of faint lines, and of what surrounds them, over a linear background."""
    color, around = (triple(srgb_from_linear(np.clip(each, 0, 1))) for each in (color_on(background), background))
    shades = (*color, 1.0), (*color, FAINT), (*around, _HALO_OPACITY)
    line, faint, halo = (imgui.color_convert_float4_to_u32(imgui.ImVec4(*shade)) for shade in shades)
    return line, faint, halo


def text(drawn: imgui.ImDrawList, at: tuple[float, float], words: str, shades: tuple[int, int], em: float) -> None:
    """Draw a text of a size in a colour with an outline, legible on any picture."""
    (color, halo), font, off = shades, imgui.get_font(), max(em / 15, 1.0)
    for right, down in ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1), (-1, 1), (1, -1)):
        drawn.add_text(font, em, imgui.ImVec2(at[0] + off * right, at[1] + off * down), halo, words)
    drawn.add_text(font, em, imgui.ImVec2(*at), color, words)


def extent(words: str, em: float) -> tuple[float, float]:
    """Return the width and the height of a text of a size."""
    found = imgui.calc_text_size(words)
    return found.x * em / imgui.get_font_size(), found.y * em / imgui.get_font_size()


class _Laid(NamedTuple):
    """Measures laid out for a camera: their marks, and their texts with the positions of these."""

    key: Any
    marks: list[Marks]
    texts: list[tuple[str, tuple[float, float]]]


def _laid(desk: Desk, document: Document) -> _Laid:
    """Return the measures in the picture; they are laid out when they, the camera or the picture have changed."""
    viewport, unit, camera = desk.viewport, document.scene.volume.unit, document.view.camera
    size = max(int(viewport.width), 1), max(int(viewport.height), 1)
    em = max(_EM * min(size[1], 1.5 * size[0]), _LEAST_EM * parts.scale())
    key = document.measures, camera, document.scene.box, size, em, unit
    before: _Laid | None = desk.panel_state.get("measures laid")
    if before is not None and before.key == key:
        return before
    view = View(camera, document.scene.box, size)
    found = [marks_of(each, view, em, unit) for each in document.measures if each.shown]
    every = [replace(marks, text=in_letters(marks.text)) for marks in found if marks is not None]
    laid = _Laid(key, every, placed_texts(every, lambda each: extent(each, em), em, size, ()))
    desk.panel_state["measures laid"] = laid
    return laid


def _measures(desk: Desk, document: Document, drawn: imgui.ImDrawList) -> None:
    laid = _laid(desk, document)
    line, faint, halo = colors(document.scene.background)
    corner, em = np.array((desk.viewport.x, desk.viewport.y)), laid.key[4]
    for width, is_halo in ((_HALO, True), (_WIDTH, False)):
        for stroke in (stroke for marks in laid.marks for stroke in marks.strokes):
            if (is_halo and stroke.faint) or not np.isfinite([stroke.start, stroke.end]).all():
                continue
            shade = halo if is_halo else faint if stroke.faint else line
            start, end = (imgui.ImVec2(*(point + corner).tolist()) for point in (stroke.start, stroke.end))
            drawn.add_line(start, end, shade, width * parts.scale())
    for words, (x, y) in laid.texts:
        width, height = extent(words, em)
        at = round(x - width / 2 + corner[0]), round(y - height / 2 + corner[1])
        text(drawn, at, words, (line, halo), em)


def _grips(desk: Desk, document: Document, drawn: imgui.ImDrawList) -> None:
    """Draw the grips; rings are those on the far side of a box, and those of measures that are not selected."""
    line, _, halo = colors(document.scene.background)
    selected, over = desk.measuring.selected, desk.panel_state.get("over measure")
    camera = document.view.camera
    for grip in measure_grips.grips_of(document.measures, selected):
        position = position_of(camera, np.array(grip.at))
        if position is None:
            continue
        held = over is not None and (grip.measure, grip.point, grip.face) == over
        color = line if grip.face is None else grips.OF_AXIS[grip.face[0]]
        hollow = measure_grips.is_hollow(document.measures[grip.measure], grip, camera, selected) and not held
        at = imgui.ImVec2(*desk.viewport.point(position))
        grips.grip(drawn, at, grips.HELD if held else color, hollow, halo if grip.face is None else grips.BORDER)


def _profiled(desk: Desk, document: Document, drawn: imgui.ImDrawList) -> None:
    """Draw the point of a profile whose values are under the mouse in the plot."""
    point = desk.panel_state.get("profile at") if desk.panel_state.get("tab") == "Measure" else None
    position = None if point is None else position_of(document.view.camera, np.array(point))
    if position is not None:
        spot, scale = imgui.ImVec2(*desk.viewport.point(position)), parts.scale()
        drawn.add_circle_filled(spot, (_RADIUS + 1) * scale, 0xFF_00_00_00)
        drawn.add_circle_filled(spot, (_RADIUS - 1) * scale, 0xFF_FF_FF_FF)


def _preview(desk: Desk, document: Document, drawn: imgui.ImDrawList) -> None:
    """Draw the points that are placed, and lines between them and to the point under the mouse."""
    line, _, halo = colors(document.scene.background)
    points = [np.array(point) for point in desk.measuring.placed]
    mouse = imgui.get_io().mouse_pos
    if desk.viewport.holds(mouse.x, mouse.y) and not imgui.get_io().want_capture_mouse:
        under = probe.first_medium(document.scene, desk.viewport.position(mouse.x, mouse.y))
        points += [] if under is None else [under]
    seen = [position_of(document.view.camera, point) for point in points]
    spots = [imgui.ImVec2(*desk.viewport.point(each)) for each in seen if each is not None]
    scale = parts.scale()
    for width, shade in ((_HALO, halo), (_WIDTH, line)):
        for one, other in pairwise(spots):
            drawn.add_line(one, other, shade, width * scale)
    for spot in spots:
        drawn.add_circle_filled(spot, (_RADIUS + 1) * scale, halo)
        drawn.add_circle_filled(spot, (_RADIUS - 1) * scale, line)


def _hint(desk: Desk, drawn: imgui.ImDrawList) -> None:
    """Say at the foot of the picture what to click next."""
    words = f"{desk.measuring.hint}, here or in a slice   (Esc: stop)"
    size, scale = imgui.calc_text_size(words), parts.scale()
    x = desk.viewport.x + (desk.viewport.width - size.x) / 2
    y = desk.viewport.y + desk.viewport.height - _FOOT * scale
    pad = 8 * scale
    corner, other = imgui.ImVec2(x - pad, y - pad), imgui.ImVec2(x + size.x + pad, y + size.y + pad)
    drawn.add_rect_filled(corner, other, 0xD8_20_1C_1A, 4 * scale)
    drawn.add_text(imgui.ImVec2(round(x), round(y)), 0xFF_F0_EE_EC, words)


def _place(desk: Desk, document: Document) -> None:
    """Place a point where the mouse is pressed and released without a drag."""
    io, state = imgui.get_io(), desk.panel_state
    mouse = io.mouse_pos
    if imgui.is_mouse_clicked(0):
        free = not io.want_capture_mouse and desk.viewport.holds(mouse.x, mouse.y) and not _modified()
        state["measure press"] = (mouse.x, mouse.y) if free else None
    pressed = state.get("measure press")
    if pressed is None or not imgui.is_mouse_released(0):
        return
    state["measure press"] = None
    if np.hypot(mouse.x - pressed[0], mouse.y - pressed[1]) > _STILL * parts.scale():
        return
    point = probe.first_medium(document.scene, desk.viewport.position(*pressed))
    if point is None:
        desk.say("nothing is visible there: click on what the picture shows, or in a slice")
    else:
        measure_changes.place(desk, point)


def _modified() -> bool:
    io = imgui.get_io()
    return bool(io.key_ctrl or io.key_shift or io.key_alt)


def _drag(desk: Desk, document: Document) -> None:
    """Start, continue or end the drag of a grip."""
    io, state = imgui.get_io(), desk.panel_state
    mouse, camera = io.mouse_pos, document.view.camera
    grips = measure_grips.grips_of(document.measures, desk.measuring.selected)
    held = state.get("measure grip")
    state["over measure"] = None
    if held is not None:
        found = next((each for each in grips if (each.measure, each.point, each.face) == held[0]), None)
        if found is None or not io.mouse_down[0]:
            state["measure grip"] = None
        else:
            state["over measure"] = held[0]
            desk.gripping = True
            _pull(desk, document, found, (mouse.x, mouse.y), held)
        return
    if io.want_capture_mouse or desk.steering.dragging or desk.gripping or not desk.viewport.holds(mouse.x, mouse.y):
        return
    for grip in grips:
        position = position_of(camera, np.array(grip.at))
        if position is None:
            continue
        x, y = desk.viewport.point(position)
        if np.hypot(x - mouse.x, y - mouse.y) >= _REACH * parts.scale():
            continue
        desk.gripping = True
        name = grip.measure, grip.point, grip.face
        state["over measure"] = name
        if imgui.is_mouse_clicked(0):
            desk.measuring.selected = grip.measure
            visible = measure_grips.on_surface(document.scene, camera, grip)
            state["measure grip"] = name, (x - mouse.x, y - mouse.y), (mouse.x, mouse.y), visible
        return


def _pull(desk: Desk, document: Document, grip: Grip, mouse: tuple[float, float], held: Any) -> None:
    """Move a grip with the mouse, from which it stays as far as it was when it was taken."""
    _, off, before, visible = held
    if mouse == before:
        return
    desk.panel_state["measure grip"] = held[0], off, mouse, visible
    wanted: Position = desk.viewport.position(mouse[0] + off[0], mouse[1] + off[1])
    each = document.measures[grip.measure]
    moved = measure_grips.dragged(each, grip, document.scene, document.view.camera, wanted, visible=visible)
    measure_changes.replaced(desk, grip.measure, moved, "measure grip")
