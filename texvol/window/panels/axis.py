"""Controls under the plot of a transfer function, aligned with its axis: colour bar and range slider."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.scene.display import straight_colors
from texvol.scene.transfer import TransferFunction
from texvol.util.color import srgb_from_linear
from texvol.window.panels import parts
from texvol.window.ranges import Ends, Hold

_BAR = 12.0  # height, in window coordinates at scale 1, as are the following
_TRACK = 16.0  # height
_HANDLE = 5.0  # half the width
REACH = 8.0
_LEAST = 1e-3  # of the histogram's range: a curve of width 0 could not be widened again
_GROOVE, _RANGE, _KNOB, _HELD = 0xFF_36_30_2E, 0xFF_90_68_40, 0xFF_CC_90_5C, 0xFF_FF_B8_73  # ABGR


@dataclass(frozen=True)
class Axis:
    """Horizontal axis of a plot: the shown range of values, and its left end and width in the window."""

    shown: Ends
    left: float
    width: float

    def position(self, value: float) -> float:
        """Return the x coordinate of a value in the window."""
        return self.left + (value - self.shown[0]) / (self.shown[1] - self.shown[0]) * self.width

    def value(self, position: float) -> float:
        """Return the value at an x coordinate of the window."""
        return self.shown[0] + (position - self.left) / self.width * (self.shown[1] - self.shown[0])


def bar(axis: Axis, medium: TransferFunction) -> None:
    """Draw the colours by value."""
    colors = srgb_from_linear(straight_colors(medium, np.linspace(*axis.shown, 65)))
    top, height = imgui.get_cursor_screen_pos().y, _BAR * parts.scale()
    draw = imgui.get_window_draw_list()
    for position in range(64):
        left, right = (imgui.color_convert_float4_to_u32(parts.shade(colors[position + end])) for end in (0, 1))
        corner = imgui.ImVec2(axis.left + axis.width * position / 64, top)
        other = imgui.ImVec2(axis.left + axis.width * (position + 1) / 64, top + height)
        draw.add_rect_filled_multi_color(corner, other, left, right, right, left)
    imgui.dummy(imgui.ImVec2(axis.width, height))


def track(axis: Axis, state: dict[str, Any], ends: Ends, bounds: Ends, rounded: Callable[[float], float]) -> Ends:
    """Show a slider for the curve's range, whose ends or whole range can be dragged; return the changed ends."""
    start, height = imgui.get_cursor_screen_pos(), _TRACK * parts.scale()
    if not (ends[1] > ends[0] and axis.width > 0):
        imgui.dummy(imgui.ImVec2(1, height))
        return ends
    aside = REACH * parts.scale()  # so that a handle at the end of the axis is fully visible and can be dragged
    imgui.set_cursor_screen_pos(imgui.ImVec2(axis.left - aside, start.y))
    imgui.invisible_button("range track", imgui.ImVec2(axis.width + 2 * aside, height))
    imgui.set_item_tooltip("drag an end of the range, or the whole range")
    at = axis.value(imgui.get_io().mouse_pos.x)
    if imgui.is_item_activated():
        state["range hold"] = Hold.taken(ends, at, aside * (axis.shown[1] - axis.shown[0]) / axis.width)
    hold: Hold | None = state.get("range hold") if imgui.is_item_active() else None
    wanted = ends
    if hold is not None and (imgui.get_io().mouse_delta.x or imgui.is_item_activated()):
        moved = hold.moved(at, bounds, _LEAST * (bounds[1] - bounds[0]))
        if moved != hold.ends:
            wanted = rounded(moved[0]) if hold.low else ends[0], rounded(moved[1]) if hold.high else ends[1]
    _draw(axis, ends, start.y, height, hold)
    return wanted if wanted[0] < wanted[1] else ends


def height() -> float:
    """Return the height of the colour bar and the slider, with the spacing below each."""
    return (_BAR + _TRACK) * parts.scale() + 2 * imgui.get_style().item_spacing.y


def _draw(axis: Axis, ends: Ends, top: float, height: float, hold: Hold | None) -> None:
    draw, middle = imgui.get_window_draw_list(), top + height / 2
    half, thin = _HANDLE * parts.scale(), height / 6
    right = axis.left + axis.width
    low, high = (min(max(axis.position(end), axis.left), right) for end in ends)

    def box(left: float, end: float, tall: float, color: int) -> None:
        corner, other = imgui.ImVec2(left, middle - tall), imgui.ImVec2(end, middle + tall)
        draw.add_rect_filled(corner, other, color, thin)

    box(axis.left, right, thin, _GROOVE)
    box(low, high, 2 * thin, _HELD if hold and hold.low and hold.high else _RANGE)
    for end, held in zip(ends, (hold and hold.low, hold and hold.high), strict=True):
        if axis.shown[0] <= end <= axis.shown[1]:  # the end is inside the plot
            position = axis.position(end)
            box(position - half, position + half, 3 * thin, _HELD if held else _KNOB)
