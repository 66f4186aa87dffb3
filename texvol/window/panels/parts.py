"""Small controls that several panels use; a control for a value returns the value that it was changed to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from texvol.util.color import linear_from_srgb, srgb_from_linear
from texvol.window import commands
from texvol.window.desk import Desk
from texvol.window.events import Event
from texvol.window.navigation import triple
from texvol.window.panels import tips
from texvol.window.steering import Viewport

Range = tuple[float, float]
Color = tuple[float, float, float]
_STEPS = ("undo", "redo")


def scale() -> float:
    """Return the scale of text and controls, at least 1."""
    return max(float(imgui.get_style().font_scale_dpi), 1.0)


def corners(viewport: Viewport) -> tuple[imgui.ImVec2, imgui.ImVec2]:
    """Return the upper left and the lower right corner of the picture in the window."""
    return imgui.ImVec2(viewport.x, viewport.y), imgui.ImVec2(viewport.x + viewport.width, viewport.y + viewport.height)


def corner_in_pixels(desk: Desk) -> tuple[int, int]:
    """Return the upper left corner of the picture in the window, in pixels."""
    viewport, (width, height) = desk.viewport, desk.pixels
    return (
        round(viewport.x * width / max(viewport.width, 1)),
        round(viewport.y * height / max(viewport.height, 1)),
    )


def shade(shown: NDArray) -> imgui.ImVec4:
    """Return an sRGB colour as an imgui vector."""
    return imgui.ImVec4(*triple(shown), 1.0)


def close_dialog(name: str) -> None:
    """Close a modal dialog that is no longer shown: else it would keep the mouse from everything else."""
    if imgui.is_popup_open(name):
        imgui.internal.close_popup_to_level(0, True)


def heard(events: list[Event]) -> list[Event]:
    """Return the events that the picture hears: while a list or an editor is open, no keys but those with ctrl."""
    if not imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
        return events
    return [each for each in events if each.kind != "key" or not each.down or "ctrl" in each.modifiers]


def fitting(text: str, width: float) -> str:
    """Return a text that is no wider; what is too much is left out in the middle."""
    if imgui.calc_text_size(text).x <= width:
        return text
    for letters in range(len(text) - 1, 2, -1):
        tail = letters // 2
        shorter = f"{text[: letters - tail]}…{text[len(text) - tail :]}"
        if imgui.calc_text_size(shorter).x <= width:
            return shorter
    return text[:1]


def note(text: str) -> None:
    """Show a wrapped text in grey."""
    imgui.push_text_wrap_pos(0.0)
    imgui.text_disabled(text)
    imgui.pop_text_wrap_pos()


def choice(label: str, current: str, names: Sequence[str]) -> str:
    """Show a drop-down list of names; return the chosen name."""
    position = names.index(current) if current in names else 0
    if imgui.begin_combo(label, names[position], imgui.ComboFlags_.height_large):
        position = listed(names, position)[0]
        imgui.end_combo()
    tips.show(label)
    return names[position]


def listed(names: Sequence[str], position: int) -> tuple[int, bool]:
    """Show the rows of an open list; return the number of the marked row, and True if it ends the list.

    A click or Enter ends the list, as Escape does; arrows, home and end lead to other rows.
    """
    last, before = len(names) - 1, position
    for key, by in (("up_arrow", -1), ("down_arrow", 1), ("home", -last), ("end", last)):
        if imgui.is_key_pressed(getattr(imgui.Key, key)):
            position = min(max(position + by, 0), last)
    chosen = any(imgui.is_key_pressed(key, False) for key in (imgui.Key.enter, imgui.Key.keypad_enter))
    if chosen or imgui.is_key_pressed(imgui.Key.escape, False):
        imgui.close_current_popup()
    for number, name in enumerate(names):
        if imgui.selectable(name, number == position)[0]:
            position, chosen = number, True
        if number == position and (position != before or imgui.is_window_appearing()):
            imgui.set_scroll_here_y()
    return position, chosen


def slider(label: str, value: float, low: float, high: float, text: str = "%.4g") -> float:
    """Show a slider; return its number."""
    changed, now = imgui.slider_float(label, float(value), float(low), float(high), text)
    tips.show(label)
    return float(np.clip(now, low, high)) if changed else value


def number(label: str, value: float) -> float:
    """Show a field for a number; return the number if a finite one was entered, else `value`."""
    changed, now = imgui.input_double(label, float(value), 0.0, 0.0, "%.5g", imgui.InputTextFlags_.enter_returns_true)
    tips.show(label)
    return float(now) if changed and np.isfinite(now) else value


def ends(label: str, pair: Range, low: float, high: float) -> Range:
    """Show two fields that are dragged for the ends of a range; return the ends, or `pair` if the range is empty."""
    speed = max((high - low) / 400, 1e-30)
    changed, first, last = imgui.drag_float_range2(
        label, float(pair[0]), float(pair[1]), speed, float(low), float(high), "%.4g", "%.4g"
    )
    tips.show(label)
    return (float(first), float(last)) if changed and first < last else pair


def window(names: tuple[str, str], pair: Range, low: float, high: float) -> Range:
    """Show sliders for the centre and the width of a window of values from `low` to `high`; return both."""
    centre = slider(names[0], pair[0], low, high)
    width = slider(names[1], pair[1], 1e-3 * (high - low), 2 * (high - low))
    return centre, width if width == pair[1] else max(width, 1e-300)


def color(label: str, linear: Color, *, small: bool = False) -> Color:
    """Show a colour field, a mere patch if `small`; return the linear colour."""
    flags = imgui.ColorEditFlags_.float | (imgui.ColorEditFlags_.no_inputs if small else 0)
    changed, picked = imgui.color_edit3(label, srgb_from_linear(np.array(linear)).tolist(), flags)
    tips.show(label)
    return triple(linear_from_srgb(np.clip(np.array(picked, np.float64), 0, 1))) if changed else linear


def switch(label: str, on: bool) -> bool:
    """Show a check box; return its state."""
    on = bool(imgui.checkbox(label, on)[1])
    tips.show(label)
    return on


def switches(states: Mapping[str, bool]) -> dict[str, bool]:
    """Show check boxes in two columns, by their labels; return their states."""
    found = {}
    for position, (label, on) in enumerate(states.items()):
        if position % 2:
            imgui.same_line(imgui.get_content_region_avail().x / 2)
        found[label] = switch(label, on)
    return found


def buttons(names: Sequence[str], in_row: int) -> str | None:
    """Show buttons of equal width, `in_row` per row; return the name of the pressed button."""
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - spacing * (in_row - 1)) / in_row
    pressed = None
    for position, name in enumerate(names):
        if position % in_row:
            imgui.same_line()
        if imgui.button(name, imgui.ImVec2(width, 0)):
            pressed = name
        tips.show(name)
    return pressed


def pressed_toggle(label: str, on: bool) -> bool:
    """Show a button that stays marked while it is `on`; return True if it is pressed."""
    if on:
        imgui.push_style_color(imgui.Col_.button.value, imgui.get_style_color_vec4(imgui.Col_.button_active.value))
    pressed = bool(imgui.button(label))
    tips.show(label)
    if on:
        imgui.pop_style_color()
    return pressed


def width_of_steps() -> float:
    """Return the width of the buttons of `steps` beside another control, including the spacing before them."""
    style = imgui.get_style()
    return sum(imgui.calc_text_size(name).x + 2 * style.frame_padding.x + style.item_spacing.x for name in _STEPS)


def steps(desk: Desk) -> None:
    """Show the buttons to undo and redo; a button is disabled if there is no step."""
    for name in _STEPS:
        if name != _STEPS[0]:
            imgui.same_line()
        imgui.begin_disabled(not desk.can_step(back=name == "undo"))
        if imgui.button(name):
            commands.run(desk, name)
        tips.show(name)
        imgui.end_disabled()
