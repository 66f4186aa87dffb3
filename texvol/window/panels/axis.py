"""What lies under the plot of a transfer function and goes with its axis: the colours, and the range's two handles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.scene.display import straight_colors
from texvol.scene.transfer import TransferFunction
from texvol.util.color import srgb_from_linear
from texvol.window.editing import Curve
from texvol.window.panels import parts
from texvol.window.ranges import Ends, Hold

_BAR = 12.0  # window coordinates at scale 1, as all here
_TRACK = 16.0
_HANDLE = 5.0  # half its width
_REACH = 8.0
_LEAST = 1e-3  # of the histogram's range: a curve of no width has no shape to come back from
_GROOVE, _RANGE, _KNOB, _HELD = 0xFF_36_30_2E, 0xFF_90_68_40, 0xFF_CC_90_5C, 0xFF_FF_B8_73  # ABGR


@dataclass(frozen=True)
class Axis:
    """What a plot shows of the values, and where in the window: left end and width."""

    shown: Ends
    left: float
    width: float

    def position(self, value: float) -> float:
        """Where a value is."""
        return self.left + (value - self.shown[0]) * self.width / (self.shown[1] - self.shown[0])

    def value(self, position: float) -> float:
        """What value is there."""
        return self.shown[0] + (position - self.left) * (self.shown[1] - self.shown[0]) / self.width


def bar(axis: Axis, medium: TransferFunction) -> None:
    """Colours by value."""
    colors = srgb_from_linear(straight_colors(medium, np.linspace(*axis.shown, 65)))
    top, height = imgui.get_cursor_screen_pos().y, _BAR * _scale()
    draw = imgui.get_window_draw_list()
    for position in range(64):
        left, right = (imgui.color_convert_float4_to_u32(parts.shade(colors[position + end])) for end in (0, 1))
        corner = imgui.ImVec2(axis.left + axis.width * position / 64, top)
        other = imgui.ImVec2(axis.left + axis.width * (position + 1) / 64, top + height)
        draw.add_rect_filled_multi_color(corner, other, left, right, right, left)
    imgui.dummy(imgui.ImVec2(axis.width, height))


def track(axis: Axis, state: dict[str, Any], curve: Curve, bounds: Ends) -> Curve:
    """The values from the first point to the last on a track: its handles, or all of it between them, are dragged."""
    ends = curve.points[0].value, curve.points[-1].value
    if not (ends[1] > ends[0] and axis.width > 0):
        return curve
    start, height = imgui.get_cursor_screen_pos(), _TRACK * _scale()
    aside = _REACH * _scale()  # a handle at the end of the axis is seen, and taken, as a whole
    imgui.set_cursor_screen_pos(imgui.ImVec2(axis.left - aside, start.y))
    imgui.invisible_button("range track", imgui.ImVec2(axis.width + 2 * aside, height))
    imgui.set_item_tooltip("drag an end of the range, or all of it")
    at = axis.value(imgui.get_io().mouse_pos.x)
    if imgui.is_item_activated():
        state["range hold"] = Hold.taken(ends, at, aside * (axis.shown[1] - axis.shown[0]) / axis.width)
    hold: Hold | None = state.get("range hold") if imgui.is_item_active() else None
    wanted = hold.moved(at, bounds, _LEAST * (bounds[1] - bounds[0])) if hold else ends
    _draw(axis, wanted, start.y, height, hold)
    return curve if wanted == ends else curve.between(*wanted)


def _draw(axis: Axis, ends: Ends, top: float, height: float, hold: Hold | None) -> None:
    draw, middle = imgui.get_window_draw_list(), top + height / 2
    half, thin = _HANDLE * _scale(), height / 6
    right = axis.left + axis.width
    low, high = (min(max(axis.position(end), axis.left), right) for end in ends)

    def box(left: float, end: float, tall: float, color: int) -> None:
        corner, other = imgui.ImVec2(left, middle - tall), imgui.ImVec2(end, middle + tall)
        draw.add_rect_filled(corner, other, color, thin)

    box(axis.left, right, thin, _GROOVE)
    box(low, high, 2 * thin, _HELD if hold and hold.low and hold.high else _RANGE)
    for end, held in zip(ends, (hold and hold.low, hold and hold.high), strict=True):
        if axis.shown[0] <= end <= axis.shown[1]:  # else it is beside what the plot shows
            position = axis.position(end)
            box(position - half, position + half, 3 * thin, _HELD if held else _KNOB)


def _scale() -> float:
    return max(float(imgui.get_style().font_scale_dpi), 1.0)
