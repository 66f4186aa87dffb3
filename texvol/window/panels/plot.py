"""Plot of a transfer function over the histogram, in which its points and its whole curve are dragged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.annotation import rounding
from texvol.scene.transfer import TransferFunction, adjusting
from texvol.util.color import srgb_from_linear
from texvol.window import gestures, lineage
from texvol.window.editing import opacity_of
from texvol.window.gestures import Drag, Frame, Hit
from texvol.window.histogram import Histogram
from texvol.window.panels import axis, parts
from texvol.window.plotted import Plotted
from texvol.window.ranges import Ends
from texvol.window.screen import Textures

LOWEST = 110.0  # height, in window coordinates at scale 1, as are the following
_POINT = 5.5
_REACH = 10.0
_STILL = 4.0  # a button that is released nearer than that to where it was pressed has clicked
_LEFT = 24.0  # margin, for the opacities
_TICK = 52.0  # least distance of ticks
_BEHIND, _GRID, _CURVE = 0xFF_1A_17_16, 0xFF_2C_28_26, 0xFF_FA_F6_F2  # ABGR
_RING, _CHOSEN, _END, _HELD = 0xFF_D2_C8_C0, 0xFF_FF_FF_FF, 0x80_CC_90_5C, 0xFF_FF_B8_73
_COLUMNS = 512  # of the filled area and of the curve, at most
_HELP = """click: add a point; on a point: edit it
drag a point: move it; right click: remove it
drag the area below the curve: shift it, or multiply its opacity
with shift, or by the wheel: change its width
drag a line at its end: move that end
ctrl + wheel: enlarge the plot; drag beside the curve: move it"""
_CURSORS = {
    "point": imgui.MouseCursor_.hand, "low": imgui.MouseCursor_.resize_ew, "high": imgui.MouseCursor_.resize_ew,
    "curve": imgui.MouseCursor_.resize_all, "empty": imgui.MouseCursor_.arrow,
}  # fmt: skip


@dataclass
class Canvas:
    """State of the plot.

    Attributes
    ----------
    bounds : (low, high)
        Values that all of the plot shows: those of the histogram, and the ends of the curve.
    shown : (low, high), optional
        Values that are shown, if they are fewer.
    pressed : Drag, optional
        Drag that has begun, or may begin, since the button is down.
    moves : bool
        True once the mouse has moved far enough for a drag.
    chosen : int
        Point that is edited.
    turned : TransferFunction, optional
        Transfer function that the wheel made last, and the time.
    """

    bounds: Ends = (0.0, 1.0)
    shown: Ends | None = None
    pressed: Drag | None = None
    moves: bool = False
    chosen: int = 0
    turned: tuple[TransferFunction, float] | None = None
    over: Hit | None = None
    logarithmic: bool = True


@dataclass(frozen=True)
class Outcome:
    """Changed transfer function, if any, and `opens` if the popup of the chosen point is to be opened."""

    medium: TransferFunction | None = None
    opens: bool = False


def show(
    canvas: Canvas, histogram: Histogram, medium: TransferFunction, length: float, height: float,
    texts: tuple[str, str], textures: Textures,
) -> tuple[Outcome, Frame]:  # fmt: skip
    """Show the plot, `height` high; `texts` are the title of the opacity and the name of the values."""
    scale, corner = parts.scale(), imgui.get_cursor_screen_pos()
    width = imgui.get_content_region_avail().x
    below = imgui.get_text_line_height() + 4 * scale
    span = canvas.bounds[1] - canvas.bounds[0]
    shown = canvas.shown or (canvas.bounds[0] - 0.02 * span, canvas.bounds[1] + 0.02 * span)
    tall = max(height - below, 2 * below)
    frame = Frame(
        shown, corner.x + _LEFT * scale, corner.y, max(width - (_LEFT + axis.REACH) * scale, 1.0), tall,
        below / (tall - below),
    )  # fmt: skip
    imgui.invisible_button("plot", imgui.ImVec2(max(width, 1.0), max(height, 1.0)))
    imgui.set_item_key_owner(imgui.Key.mouse_wheel_y)  # the wheel does not scroll the panel
    outcome = _heard(canvas, frame, medium, length)
    draw = imgui.get_window_draw_list()
    end = imgui.ImVec2(frame.left + frame.width, frame.top + frame.height)
    draw.add_rect_filled(imgui.ImVec2(frame.left, frame.top), end, _BEHIND)
    _axes(draw, frame, texts[1])
    draw.push_clip_rect(imgui.ImVec2(frame.left, frame.top), end, True)
    columns = int(np.clip(frame.width / scale, 2, _COLUMNS))
    _fill(draw, textures, Plotted(frame, histogram, canvas.logarithmic, medium, length, columns))
    _line(draw, frame, medium, length, columns)
    _ends(draw, frame, canvas, adjusting.ends(medium))
    draw.pop_clip_rect()
    _points(draw, canvas, frame, medium, length)
    _texts(draw, canvas, frame, medium, length, texts[0])
    _help(draw, corner, frame)
    return outcome, frame


def _heard(canvas: Canvas, frame: Frame, medium: TransferFunction, length: float) -> Outcome:
    """Process mouse and wheel; return what they do."""
    io = imgui.get_io()
    at, scale = (io.mouse_pos.x, io.mouse_pos.y), parts.scale()
    hovered, active = imgui.is_item_hovered(), imgui.is_item_active()
    inside = hovered and frame.holds(*at)
    canvas.over = gestures.hit(frame, medium, length, at, _REACH * scale) if inside and not active else None
    if imgui.is_item_activated() and inside:
        found = gestures.hit(frame, medium, length, at, _REACH * scale)
        canvas.pressed, canvas.moves = Drag(medium, found, at, widens=io.key_shift), False
        canvas.chosen = found.index if found.kind == "point" else canvas.chosen
    kind = canvas.pressed.hit.kind if canvas.pressed else canvas.over.kind if canvas.over else ""
    if kind:
        imgui.set_mouse_cursor(_CURSORS[kind])
    if inside and canvas.over and canvas.over.kind == "point" and imgui.is_mouse_clicked(1):
        return Outcome(_without(canvas, medium, canvas.over.index))
    if inside and io.mouse_wheel:
        return _turned(canvas, frame, medium, at[0])
    if canvas.pressed is None:
        return Outcome()
    if not active:
        drag, canvas.pressed = canvas.pressed, None
        return Outcome() if canvas.moves or not imgui.is_item_deactivated() else _clicked(canvas, frame, drag, length)
    return _dragged(canvas, frame, canvas.pressed, at, length)


def _dragged(canvas: Canvas, frame: Frame, drag: Drag, at: tuple[float, float], length: float) -> Outcome:
    io = imgui.get_io()
    across, along = at[0] - drag.at[0], at[1] - drag.at[1]
    if not canvas.moves and np.hypot(across, along) >= _STILL * parts.scale():
        canvas.moves = True
        upright = drag.hit.kind == "curve" and abs(along) > abs(across) and not drag.widens
        canvas.pressed = drag = Drag(drag.medium, drag.hit, drag.at, upright, drag.widens)
    if not canvas.moves or not (io.mouse_delta.x or io.mouse_delta.y):
        return Outcome()
    if drag.hit.kind == "empty":
        _pan(canvas, frame, io.mouse_delta.x)
        return Outcome()
    return Outcome(drag.moved(frame, *at, length))


def _clicked(canvas: Canvas, frame: Frame, drag: Drag, length: float) -> Outcome:
    """Open the point that was clicked, or add one."""
    if drag.hit.kind == "point":
        return Outcome(opens=True)
    layers = lineage.layers_of(drag.medium)
    if len(layers.curve.points) >= gestures.ENOUGH:
        return Outcome()
    value, opacity = frame.rounded(frame.value(drag.at[0])), frame.opacity(drag.at[1])
    here = float(opacity_of(drag.medium.at(value)[3], length))
    on_curve = abs(frame.y(here) - drag.at[1]) <= _REACH * parts.scale() / 2
    extinction = None if on_curve else gestures.extinction_of(min(opacity, gestures.MOST_OPACITY), length)
    curve, canvas.chosen = layers.curve.added(value, extinction)
    return Outcome(lineage.edited(drag.medium, layers.with_curve(curve)))


def _without(canvas: Canvas, medium: TransferFunction, index: int) -> TransferFunction:
    layers = lineage.layers_of(medium)
    canvas.chosen = max(index - 1, 0)
    return lineage.edited(medium, layers.with_curve(layers.curve.removed(index)))


def _turned(canvas: Canvas, frame: Frame, medium: TransferFunction, x: float) -> Outcome:
    """Change the width of the curve by the wheel at it; elsewhere, or with ctrl, enlarge the plot."""
    io = imgui.get_io()
    factor = gestures.notched(io.mouse_wheel)
    if canvas.over is not None and canvas.over.kind != "empty" and not io.key_ctrl:
        return Outcome(gestures.widened(medium, frame, frame.value(x), factor))
    about, span = frame.value(x), canvas.bounds[1] - canvas.bounds[0]
    low, high = (about + (end - about) / factor for end in frame.shown)
    wide = high - low
    canvas.shown = None if wide >= 1.04 * span or not wide > 1e-9 * span else (low, high)
    return Outcome()


def _pan(canvas: Canvas, frame: Frame, by: float) -> None:
    """Move the values that an enlarged plot shows."""
    if canvas.shown is not None:
        low, high = canvas.bounds
        width = canvas.shown[1] - canvas.shown[0]
        start = canvas.shown[0] - by * width / frame.width
        start = min(max(start, low - width / 2), high - width / 2)
        canvas.shown = start, start + width


def _axes(draw: imgui.ImDrawList, frame: Frame, name: str) -> None:
    """Draw grid lines, opacities at the left and values below."""
    scale, grey = parts.scale(), imgui.get_color_u32(imgui.Col_.text_disabled)
    line = imgui.get_text_line_height()
    right, bottom = frame.left + frame.width, frame.top + frame.height
    for opacity, text in ((0.0, "0"), (0.5, ".5"), (1.0, "1")):
        y = frame.y(opacity)
        draw.add_line(imgui.ImVec2(frame.left, y), imgui.ImVec2(right, y), _GRID)
        size = imgui.calc_text_size(text)
        draw.add_text(imgui.ImVec2(frame.left - size.x - 5 * scale, min(y - line / 2, bottom - line)), grey, text)
    low, high = frame.shown
    step = rounding.round_up((high - low) * _TICK * scale / max(frame.width, 1.0))
    ticks = rounding.multiples(low, high, step)
    texts, factor = rounding.written(ticks, step)
    name = f"{name} {factor}".strip()
    wide = imgui.calc_text_size(name).x
    for tick, text in zip(ticks, texts, strict=True):
        x, half = frame.x(float(tick)), imgui.calc_text_size(text).x / 2
        draw.add_line(imgui.ImVec2(x, frame.top), imgui.ImVec2(x, bottom), _GRID)
        if frame.left - 10 * scale <= x - half and x + half <= right - wide - 8 * scale:
            draw.add_text(imgui.ImVec2(x - half, bottom + 2 * scale), grey, text)
    draw.add_text(imgui.ImVec2(right - wide, bottom + 2 * scale), grey, name)


def _fill(draw: imgui.ImDrawList, textures: Textures, shown: Plotted) -> None:
    """Draw the histogram, and the area below the curve in its colours."""
    texture = imgui.ImTextureRef(textures.get("plot", shown, shown.pixels))
    left, top, right, bottom = shown.place
    draw.add_image(texture, imgui.ImVec2(left, top), imgui.ImVec2(right, bottom))


def _line(draw: imgui.ImDrawList, frame: Frame, medium: TransferFunction, length: float, pieces: int) -> None:
    """Draw the curve."""
    middles = np.linspace(*frame.shown, pieces)
    at_points = np.concatenate([medium.values, np.nextafter(medium.values, -np.inf)])
    values = np.unique(np.concatenate([middles, frame.shown, at_points]))
    values = values[(values >= frame.shown[0]) & (values <= frame.shown[1])]
    heights = opacity_of(medium.at(values)[:, 3], length).tolist()
    line: list[Any] = [
        imgui.ImVec2(frame.x(value), frame.y(height)) for value, height in zip(values.tolist(), heights, strict=True)
    ]
    draw.add_polyline(line, _CURVE, 1.6 * parts.scale(), 0)


def _ends(draw: imgui.ImDrawList, frame: Frame, canvas: Canvas, ends: Ends) -> None:
    """Draw the ends of the range."""
    for kind, end in zip(("low", "high"), ends, strict=True):
        held = canvas.pressed is not None and canvas.pressed.hit.kind in (kind, "curve")
        over = canvas.over is not None and canvas.over.kind == kind
        x = frame.x(end)
        color = _HELD if held or over else _END
        top, bottom = imgui.ImVec2(x, frame.y(1.0)), imgui.ImVec2(x, frame.y(0.0))
        draw.add_line(top, bottom, color, (2.0 if over else 1.0) * parts.scale())


def _points(draw: imgui.ImDrawList, canvas: Canvas, frame: Frame, medium: TransferFunction, length: float) -> None:
    points, scale = lineage.layers_of(medium).curve.points, parts.scale()
    if len(points) > gestures.ENOUGH:
        return
    for index, point in enumerate(points):
        x, y = frame.x(point.value), frame.y(float(opacity_of(point.extinction, length)))
        if not frame.left - 1 <= x <= frame.left + frame.width + 1:
            continue
        over = canvas.over is not None and (canvas.over.kind, canvas.over.index) == ("point", index)
        chosen = over or (canvas.pressed is not None and canvas.pressed.hit == Hit("point", index))
        shown = point.color if max(point.color) <= 1 else tuple(each / max(point.color) for each in point.color)
        fill = imgui.color_convert_float4_to_u32(parts.shade(srgb_from_linear(np.array(shown))))
        radius = (_POINT + 1.5 * chosen) * scale
        draw.add_circle_filled(imgui.ImVec2(x, y), radius, fill)
        draw.add_circle(imgui.ImVec2(x, y), radius, _CHOSEN if chosen else _RING, thickness=1.6 * scale)


def _texts(
    draw: imgui.ImDrawList, canvas: Canvas, frame: Frame, medium: TransferFunction, length: float, title: str
) -> None:
    """Draw what the axis of the opacity means, or what a drag changes, or the numbers at the mouse."""
    io, text = imgui.get_io(), title
    if canvas.pressed is not None and canvas.moves:
        text = _said(canvas.pressed, medium, canvas, length)
    elif canvas.over is not None:
        value = frame.rounded(frame.value(io.mouse_pos.x))
        opacity = float(opacity_of(medium.at(value)[3], length))
        text = f"at {rounding.plain(value)}: opacity {opacity:.2f}"
    scale = parts.scale()
    size = imgui.calc_text_size(text)
    at = imgui.ImVec2(frame.left + frame.width - size.x - 6 * scale, frame.top + 2 * scale)
    draw.add_text(at, imgui.get_color_u32(imgui.Col_.text), text)


def _help(draw: imgui.ImDrawList, corner: imgui.ImVec2, frame: Frame) -> None:
    """Draw a question mark in the lower left corner, with a tooltip that says what the mouse does in the plot."""
    mouse, scale, line = imgui.get_io().mouse_pos, parts.scale(), imgui.get_text_line_height()
    top, right = frame.top + frame.height, corner.x + _LEFT * scale
    over = imgui.is_item_hovered() and mouse.x < right and mouse.y >= top - line
    color = imgui.Col_.text if over else imgui.Col_.text_disabled
    draw.add_text(imgui.ImVec2(corner.x + 4 * scale, top + 2 * scale), imgui.get_color_u32(color), "?")
    if over:
        imgui.set_tooltip(_HELP)


def _said(drag: Drag, medium: TransferFunction, canvas: Canvas, length: float) -> str:
    if drag.hit.kind == "point":
        points = lineage.layers_of(medium).curve.points
        point = points[min(drag.hit.index, len(points) - 1)]
        return f"{rounding.plain(point.value)}: opacity {float(opacity_of(point.extinction, length)):.2f}"
    if drag.upright:
        return f"opacity × {lineage.lineage_of(medium).factor:.3g}"
    if drag.hit.kind == "empty":
        return ""
    low, high = adjusting.ends(medium)
    return f"range {rounding.plain(low)} to {rounding.plain(high)}"
