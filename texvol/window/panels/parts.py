"""Small controls that several panels use."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from texvol.util.color import linear_from_srgb, srgb_from_linear
from texvol.window.steering import Viewport

Color = tuple[float, float, float]


def scale() -> float:
    """Return the scale of text and controls, at least 1."""
    return max(float(imgui.get_style().font_scale_dpi), 1.0)


def corners(viewport: Viewport) -> tuple[imgui.ImVec2, imgui.ImVec2]:
    """Return the upper left and the lower right corner of the picture in the window."""
    return imgui.ImVec2(viewport.x, viewport.y), imgui.ImVec2(viewport.x + viewport.width, viewport.y + viewport.height)


def shade(shown: NDArray) -> imgui.ImVec4:
    """Return an sRGB colour as an imgui vector."""
    red, green, blue = (float(part) for part in shown)
    return imgui.ImVec4(red, green, blue, 1.0)


def choice(label: str, current: str, names: Sequence[str]) -> str:
    """Show a drop-down list of names; return the chosen name."""
    position = names.index(current) if current in names else 0
    _, chosen = imgui.combo(label, position, list(names))
    return names[chosen]


def slider(label: str, value: float, low: float, high: float, text: str = "%.4g") -> tuple[bool, float]:
    """Show a slider; return True if it was moved, and its number."""
    changed, now = imgui.slider_float(label, float(value), float(low), float(high), text)
    return changed, float(np.clip(now, low, high)) if changed else float(value)


def number(label: str, value: float) -> tuple[bool, float]:
    """Show a field for a number; return True if a finite number was entered, and the number."""
    changed, now = imgui.input_double(label, float(value), 0.0, 0.0, "%.5g", imgui.InputTextFlags_.enter_returns_true)
    return changed and bool(np.isfinite(now)), float(now)


def ends(label: str, pair: tuple[float, float], low: float, high: float) -> tuple[bool, tuple[float, float]]:
    """Show two fields that are dragged for the ends of a range; return True if one changed, and the ends."""
    speed = max((high - low) / 400, 1e-30)
    changed, first, last = imgui.drag_float_range2(
        label, float(pair[0]), float(pair[1]), speed, float(low), float(high), "%.4g", "%.4g"
    )
    return changed, (float(first), float(last))


def color(label: str, linear: Sequence[float], *, small: bool = False) -> tuple[bool, Color]:
    """Show a colour field, a mere patch if `small`; return True if it changed, and the linear colour."""
    shown = srgb_from_linear(np.clip(np.asarray(linear, np.float64), 0, 1))
    flags = imgui.ColorEditFlags_.float | (imgui.ColorEditFlags_.no_inputs if small else 0)
    changed, picked = imgui.color_edit3(label, [float(part) for part in shown], flags)
    if not changed:
        return False, (float(linear[0]), float(linear[1]), float(linear[2]))
    red, green, blue = linear_from_srgb(np.clip(np.array(picked, np.float64), 0, 1))
    return True, (float(red), float(green), float(blue))


def switch(label: str, on: bool) -> tuple[bool, bool]:
    """Show a check box; return True if it was clicked, and its state."""
    changed, now = imgui.checkbox(label, on)
    return bool(changed), bool(now)


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
    return pressed
