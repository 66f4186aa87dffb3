"""Measure tab: tools, the list of measures, the values of the selected one, and volumes of labels."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.annotation.measures import value_text
from texvol.scene.measures.measure import KINDS, MOST_SAMPLES, Measure, called
from texvol.window import measure_changes
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.measuring import STEPS
from texvol.window.panels import measure_values, parts
from texvol.window.panels.measure_letters import in_letters

_NAME = 0.42  # of the panel's width
_LONGEST = 80  # letters of a name
_TOOLS = {
    "ruler": "distance of two points: click both in the picture or in a slice",
    "angle": "angle of three points: the second one is its vertex",
    "box": "volume along the axes, with mean and deviation of the values inside: click its middle, then drag its faces",
    "profile": "values along a line: click both ends",
}
assert tuple(_TOOLS) == KINDS


def show(desk: Desk, document: Document) -> None:
    """Show the Measure tab."""
    desk.measuring.follow(document)
    desk.panel_state["profile at"] = None
    _tools(desk)
    _list(desk, document)
    number = desk.measuring.selected
    if number is not None and number < len(document.measures):
        _selected(desk, document, number)
    measure_values.labels(desk, document)
    _table(desk, document)


def _tools(desk: Desk) -> None:
    """Show a button for each kind; that of the tool in hand is lit."""
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - spacing * (len(_TOOLS) - 1)) / len(_TOOLS)
    for position, (kind, about) in enumerate(_TOOLS.items()):
        if position:
            imgui.same_line()
        in_hand = desk.measuring.tool == kind
        if in_hand:
            lit = imgui.get_style().color_(imgui.Col_.button_active.value)
            imgui.push_style_color(imgui.Col_.button.value, lit)
        if imgui.button(kind, imgui.ImVec2(width, 0)):
            measure_changes.take(desk, kind)
        if in_hand:
            imgui.pop_style_color()
        imgui.set_item_tooltip(about)
    hint = desk.measuring.hint
    parts.note(f"{hint}, in the picture or in a slice; Esc stops." if hint else "Choose what to measure.")


def _list(desk: Desk, document: Document) -> None:
    """Show a row for each measure."""
    imgui.separator_text("Measures")
    if not document.measures:
        imgui.text_disabled("none")
    names = called(document.measures)
    unit = document.scene.volume.unit
    for number, each in enumerate(document.measures):
        imgui.push_id(number)
        gone = _row(desk, each, number, names[number], unit)
        imgui.pop_id()
        if gone:
            return  # the numbers of those below have changed


def _row(desk: Desk, each: Measure, number: int, name: str, unit: str) -> bool:
    """Show the switch, name, value and remover of a measure; return True if it is removed."""
    state, style = desk.measuring, imgui.get_style()
    shown = parts.switch("##shown measure", each.shown)
    if shown != each.shown:
        measure_changes.replaced(desk, number, replace(each, shown=shown))
        return False
    imgui.same_line()
    imgui.set_next_item_width(_NAME * imgui.get_content_region_avail().x)
    flags = imgui.InputTextFlags_.enter_returns_true | imgui.InputTextFlags_.auto_select_all
    _, typed = imgui.input_text_with_hint("##name", name, each.name, flags)
    imgui.set_item_tooltip("name of the measure, in pictures and tables")
    if imgui.is_item_activated():
        state.selected = number
    if imgui.is_item_deactivated_after_edit() and typed.strip()[:_LONGEST] != each.name:
        measure_changes.replaced(desk, number, replace(each, name=typed.strip()[:_LONGEST]))
    imgui.same_line()
    remover = imgui.get_frame_height()
    width = imgui.get_content_region_avail().x - remover - style.item_spacing.x
    # A selectable fills the spacing around it, and begins where a text would stand beside the other controls.
    imgui.push_style_var(imgui.StyleVar_.item_spacing, imgui.ImVec2(style.item_spacing.x, 0))
    imgui.push_style_var(imgui.StyleVar_.selectable_text_align, imgui.ImVec2(0, 0.5))
    imgui.set_cursor_pos_y(imgui.get_cursor_pos_y() - style.frame_padding.y)
    value, chosen = in_letters(value_text(each, unit)), state.selected == number
    if imgui.selectable(value, chosen, 0, imgui.ImVec2(width, remover))[0]:
        state.selected = None if chosen else number
    imgui.pop_style_var(2)
    imgui.set_item_tooltip(f"{each.kind}; click to see its values")
    imgui.same_line()
    removed = imgui.button("x", imgui.ImVec2(remover, remover))
    imgui.set_item_tooltip("remove this measure (Delete); undo brings it back")
    if removed:
        measure_changes.replaced(desk, number, None)
    return removed


def _selected(desk: Desk, document: Document, number: int) -> None:
    """Show the points and values of the selected measure."""
    each = document.measures[number]
    imgui.separator_text(called(document.measures)[number])
    imgui.push_id(f"selected {number}")
    for position, point in enumerate(each.points):
        _point(desk, each, number, position, point)
    found, stale = measure_changes.values_of(desk, number)
    if found is None:
        imgui.text_disabled("counting …")
    else:
        if stale:
            imgui.push_style_var(imgui.StyleVar_.alpha.value, 0.6)
        measure_values.show(desk, document, found, each)
        if stale:
            imgui.pop_style_var()
    if each.kind == "profile":
        _samples(desk, each, number, len(found.profile.distances) if found and found.profile else 0)
    imgui.pop_id()


def _point(desk: Desk, each: Measure, number: int, position: int, point: tuple[float, float, float]) -> None:
    """Show the coordinates of a point; they can be entered."""
    what = {"angle": ("arm", "vertex", "arm"), "box": ("corner", "corner")}
    label = what.get(each.kind, ("start", "end"))[position]
    imgui.push_id(position)
    imgui.set_next_item_width(-parts_width(label))
    entered, typed = imgui.input_float3(
        label, [float(x) for x in point], "%.6g", imgui.InputTextFlags_.enter_returns_true
    )
    imgui.set_item_tooltip("x, y and z of the point in the world; Enter moves it there")
    imgui.pop_id()
    if entered and np.isfinite(typed).all():
        # The field holds single precision: a coordinate that was not changed keeps its digits.
        wanted = [old if np.float32(old) == np.float32(new) else new for old, new in zip(point, typed, strict=True)]
        measure_changes.replaced(desk, number, each.moved(position, wanted))


def parts_width(label: str) -> float:
    """Return the width of a label beside a control that fills the panel."""
    widest = max(imgui.calc_text_size(each).x for each in ("corner", "vertex", label))
    return widest + imgui.get_style().item_inner_spacing.x


def _samples(desk: Desk, each: Measure, number: int, count: int) -> None:
    """Show the number of points of a profile, which can be entered."""
    imgui.set_next_item_width(-imgui.calc_text_size("points").x - imgui.get_style().item_inner_spacing.x)
    flags = imgui.InputTextFlags_.enter_returns_true
    entered, typed = imgui.input_int("points", each.samples or count, 0, 0, flags)
    imgui.set_item_tooltip("number of points, at equal distances; 0: as many as samples of the volume")
    if entered:
        samples = int(np.clip(typed, 2, MOST_SAMPLES)) if typed > 0 else None
        measure_changes.replaced(desk, number, replace(each, samples=samples))


def _table(desk: Desk, document: Document) -> None:
    """Show the buttons that copy and save the values."""
    has_values = bool(document.measures) or any(volume.labels for volume in document.scene.volumes)
    if not has_values:
        return
    imgui.separator()
    pressed: Any = None
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - spacing) / 2
    tips = {
        "copy as CSV": "all values as a table, for a spreadsheet or a program (ctrl-m)",
        "save as CSV …": "all values in a file, as `texvol measure` writes them",
    }
    for position, (name, about) in enumerate(tips.items()):
        if position:
            imgui.same_line()
        if imgui.button(name, imgui.ImVec2(width, 0)):
            pressed = name
        imgui.set_item_tooltip(about)
    if pressed == "copy as CSV":
        measure_changes.copy(desk, document)
    elif pressed:
        measure_changes.browse_to_save(desk, document)
    number = desk.measuring.selected
    if number is not None and number < len(document.measures):
        if imgui.button(f"copy {called(document.measures)[number]}###copy one", imgui.ImVec2(-1, 0)):
            measure_changes.copy(desk, document, number)
        imgui.set_item_tooltip("the values of the selected measure; a profile with a column for each volume")


assert STEPS.keys() == _TOOLS.keys()
