"""Small buttons with drawn symbols: an eye, and those of a film player. The window's font has none of them."""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np
from imgui_bundle import imgui

Symbol = Literal["eye", "hidden", "play", "pause", "back", "next"]
_LINE = 1.5  # window coordinates at scale 1
_LID = 24  # line segments of half an eye


def button(label: str, symbol: Symbol, *, dim: bool = False) -> bool:
    """Show a square button with a symbol; return True if it is pressed.

    Parameters
    ----------
    dim : bool
        True to draw the symbol in grey.
    """
    side = imgui.get_frame_height()
    start = imgui.get_cursor_screen_pos()
    pressed = imgui.button(label, imgui.ImVec2(side, side))
    color = imgui.get_color_u32(imgui.Col_.text_disabled if dim else imgui.Col_.text)
    middle = imgui.ImVec2(start.x + side / 2, start.y + side / 2)
    _DRAWN[symbol](middle, 0.32 * side, color)
    return bool(pressed)


def _triangle(middle: imgui.ImVec2, size: float, color: int, way: int) -> None:
    drawn = imgui.get_window_draw_list()
    tip, base = middle.x + way * size, middle.x - way * 0.7 * size
    corners = [(tip, middle.y), (base, middle.y + way * size), (base, middle.y - way * size)]
    one, two, three = (imgui.ImVec2(*each) for each in corners)
    drawn.add_triangle_filled(one, two, three, color)


def _play(middle: imgui.ImVec2, size: float, color: int) -> None:
    _triangle(middle, size, color, 1)


def _pause(middle: imgui.ImVec2, size: float, color: int) -> None:
    drawn = imgui.get_window_draw_list()
    for left in (-0.8, 0.25):
        x = middle.x + left * size
        drawn.add_rect_filled(imgui.ImVec2(x, middle.y - size), imgui.ImVec2(x + 0.55 * size, middle.y + size), color)


def _step(middle: imgui.ImVec2, size: float, color: int, way: int) -> None:
    _triangle(imgui.ImVec2(middle.x - way * 0.25 * size, middle.y), size, color, way)
    drawn = imgui.get_window_draw_list()
    ends = sorted((middle.x + way * 0.8 * size, middle.x + way * 1.15 * size))
    drawn.add_rect_filled(imgui.ImVec2(ends[0], middle.y - size), imgui.ImVec2(ends[1], middle.y + size), color)


def _eye(middle: imgui.ImVec2, size: float, color: int) -> None:
    drawn = imgui.get_window_draw_list()
    across = np.linspace(-1.25, 1.25, _LID)
    lid = 0.8 * size * (1 - (across / 1.25) ** 2)
    thick = _LINE * size / 5.5
    for way in (-1, 1):
        points = [imgui.ImVec2(middle.x + size * x, middle.y + way * y) for x, y in zip(across, lid, strict=True)]
        for one, other in pairwise(points):
            drawn.add_line(one, other, color, thick)
    drawn.add_circle_filled(middle, 0.42 * size, color)


def _hidden(middle: imgui.ImVec2, size: float, color: int) -> None:
    _eye(middle, size, color)
    start = imgui.ImVec2(middle.x - 1.1 * size, middle.y + 1.1 * size)
    end = imgui.ImVec2(middle.x + 1.1 * size, middle.y - 1.1 * size)
    imgui.get_window_draw_list().add_line(start, end, color, 1.3 * _LINE * size / 5.5)


_DRAWN = {
    "eye": _eye,
    "hidden": _hidden,
    "play": _play,
    "pause": _pause,
    "back": lambda middle, size, color: _step(middle, size, color, -1),
    "next": lambda middle, size, color: _step(middle, size, color, 1),
}
