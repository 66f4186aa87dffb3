"""Small controls that several panels have."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from texvol.util.color import linear_from_srgb, srgb_from_linear

Color = tuple[float, float, float]


def shade(shown: NDArray) -> imgui.ImVec4:
    """A colour as it is seen."""
    red, green, blue = (float(part) for part in shown)
    return imgui.ImVec4(red, green, blue, 1.0)


def choice(label: str, current: str, names: Sequence[str]) -> str:
    """One of several names; what is chosen now."""
    position = names.index(current) if current in names else 0
    _, chosen = imgui.combo(label, position, list(names))
    return names[chosen]


def slider(label: str, value: float, low: float, high: float, text: str = "%.4g") -> tuple[bool, float]:
    """A number between two; whether it was changed, and what it is."""
    changed, now = imgui.slider_float(label, float(value), float(low), float(high), text)
    return changed, float(np.clip(now, low, high)) if changed else float(value)


def number(label: str, value: float) -> tuple[bool, float]:
    """A number to be typed."""
    changed, now = imgui.input_double(label, float(value), 0.0, 0.0, "%.5g", imgui.InputTextFlags_.enter_returns_true)
    return changed and bool(np.isfinite(now)), float(now)


def ends(label: str, pair: tuple[float, float], low: float, high: float) -> tuple[bool, tuple[float, float]]:
    """Two ends of a range, the one not beyond the other."""
    speed = max((high - low) / 400, 1e-30)
    changed, first, last = imgui.drag_float_range2(
        label, float(pair[0]), float(pair[1]), speed, float(low), float(high), "%.4g", "%.4g"
    )
    return changed, (float(first), float(last))


def color(label: str, linear: Sequence[float], *, small: bool = False) -> tuple[bool, Color]:
    """A colour, picked as it is seen; linear. A small one is only a patch to be clicked."""
    shown = srgb_from_linear(np.clip(np.asarray(linear, np.float64), 0, 1))
    flags = imgui.ColorEditFlags_.float | (imgui.ColorEditFlags_.no_inputs if small else 0)
    changed, picked = imgui.color_edit3(label, [float(part) for part in shown], flags)
    if not changed:
        return False, (float(linear[0]), float(linear[1]), float(linear[2]))
    red, green, blue = linear_from_srgb(np.clip(np.array(picked, np.float64), 0, 1))
    return True, (float(red), float(green), float(blue))


def switch(label: str, on: bool) -> tuple[bool, bool]:
    """A check box."""
    changed, now = imgui.checkbox(label, on)
    return bool(changed), bool(now)


def buttons(names: Sequence[str], in_row: int) -> str | None:
    """Buttons of one width, so many in a row; the one that was pressed."""
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - spacing * (in_row - 1)) / in_row
    pressed = None
    for position, name in enumerate(names):
        if position % in_row:
            imgui.same_line()
        if imgui.button(name, imgui.ImVec2(width, 0)):
            pressed = name
    return pressed
