"""Popup at a point of the transfer function: value, opacity and colour as numbers, and its removal."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui

from texvol.scene.transfer import TransferFunction
from texvol.window import lineage
from texvol.window.editing import extinction_of, opacity_of
from texvol.window.gestures import MOST_OPACITY, Frame
from texvol.window.panels import parts
from texvol.window.panels.plot import Canvas

NAME = "point of the transfer function"
_WIDTH = 150.0  # of a control, in window coordinates at scale 1


def open_at(canvas: Canvas, frame: Frame, medium: TransferFunction, length: float) -> None:
    """Open the popup below the chosen point."""
    point = lineage.layers_of(medium).curve.points[canvas.chosen]
    scale = parts.scale()
    y = frame.y(float(opacity_of(point.extinction, length)))
    imgui.open_popup(NAME)
    imgui.set_next_window_pos(imgui.ImVec2(frame.x(point.value) + 8 * scale, y + 12 * scale), imgui.Cond_.appearing)


def show(canvas: Canvas, medium: TransferFunction, length: float, unit: str) -> TransferFunction | None:
    """Show the popup if it is open; return the changed transfer function."""
    if not imgui.begin_popup(NAME):
        return None
    points = lineage.layers_of(medium).curve.points
    index = min(canvas.chosen, len(points) - 1)
    changed = None
    imgui.push_item_width(_WIDTH * parts.scale())
    imgui.push_id(index)
    imgui.text_disabled(f"point {index + 1} of {len(points)}")
    changed = _numbers(medium, index, length, unit)
    imgui.begin_disabled(len(points) == 1)
    if imgui.button("remove", imgui.ImVec2(_WIDTH * parts.scale(), 0)):
        layers = lineage.layers_of(medium)
        changed = lineage.edited(medium, layers.with_curve(layers.curve.removed(index)))
        canvas.chosen = max(index - 1, 0)
        imgui.close_current_popup()
    imgui.set_item_tooltip("take the point away; a right click at a point does it, too")
    imgui.end_disabled()
    imgui.pop_id()
    imgui.pop_item_width()
    imgui.end_popup()
    return changed


def _numbers(medium: TransferFunction, index: int, length: float, unit: str) -> TransferFunction | None:
    """Show the numbers of a point; return the changed transfer function."""
    layers = lineage.layers_of(medium)
    point = layers.curve.points[index]
    value, extinction = parts.number("value", point.value), point.extinction
    was_opaque = bool(np.isinf(extinction))
    imgui.begin_disabled(was_opaque)
    opacity = float(opacity_of(extinction, length))
    wanted = parts.number(f"opacity /{length:.3g} {unit or 'units'}", opacity)
    if wanted != opacity:
        extinction = extinction_of(float(np.clip(wanted, 0, MOST_OPACITY)), length)
    shown = 0.0 if was_opaque else point.extinction
    number = parts.number(f"extinction /{unit or 'unit'}", shown)
    extinction = extinction if number == shown else max(number, 0.0)
    imgui.end_disabled()
    opaque = parts.switch("opaque", was_opaque)
    if opaque != was_opaque:
        extinction = np.inf if opaque else extinction_of(MOST_OPACITY, length)
    color = _color(medium, point.color)
    if (value, extinction) != (point.value, point.extinction):
        return lineage.edited(medium, layers.with_curve(layers.curve.moved(index, value, extinction)))
    return None if color == point.color else lineage.edited(medium, layers.colored(index, color))


def _color(medium: TransferFunction, color: parts.Color) -> parts.Color:
    """Show the colour; that of a medium that emits keeps its strength, which may be above 1."""
    strength = max(*color, 1e-300) if medium.emissive else 1.0
    shown = (color[0] / strength, color[1] / strength, color[2] / strength)
    wanted = parts.color("colour", shown)
    return color if wanted == shown else (wanted[0] * strength, wanted[1] * strength, wanted[2] * strength)
