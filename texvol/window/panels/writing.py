"""Progress of the file that is being written, over the picture, with a button that stops it."""

from __future__ import annotations

import os

from imgui_bundle import imgui

from texvol.util.time_left import duration
from texvol.window.desk import Desk
from texvol.window.naming import shortened
from texvol.window.panels import parts

_MARGIN, _WIDTH = 10.0, 330.0  # window coordinates at scale 1
_MOST = 0.8  # of the picture's width
_LETTERS = 40  # of the file's name
_LEAST = 300.0  # of the picture's sides: in a smaller one the text is a tooltip


def show(desk: Desk) -> None:
    """Show how much of the file is written."""
    desk.panel_state["writing height"] = 0.0
    if desk.writing is None:
        return
    scale, viewport = parts.scale(), desk.viewport
    width = max(min(_WIDTH * scale, _MOST * viewport.width), 60.0)
    imgui.set_next_window_pos(imgui.ImVec2(viewport.x + _MARGIN * scale, viewport.y + _MARGIN * scale))
    imgui.set_next_window_size(imgui.ImVec2(width, 0))
    imgui.set_next_window_bg_alpha(0.9)
    flags = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_nav
    imgui.begin("writing", None, flags | imgui.WindowFlags_.no_focus_on_appearing)
    waiting = f", {len(desk.orders)} more after it" if desk.orders else ""
    path = str(desk.job.get("path", ""))
    name = os.path.basename(path) or "a file"
    forecast = desk.moving.forecasts.get(path)
    # Nothing is known of the speed before the second picture of a film; before the first one, that of another file is.
    left = desk.moving.left.text(desk.now) if desk.writing > 0 else ""
    left = left or ("" if forecast is None else f"{duration(forecast)} or so")
    text = f"writing {shortened(name, _LETTERS)}{waiting}" + (f", {left}" if left else "")
    is_small = min(viewport.width, viewport.height) < _LEAST * scale
    if not is_small:
        imgui.text_wrapped(text)
    style = imgui.get_style()
    button = imgui.calc_text_size("stop").x + 2 * style.frame_padding.x
    room = imgui.get_content_region_avail().x - button - style.item_spacing.x
    imgui.progress_bar(desk.writing, imgui.ImVec2(max(room, 1), 0), f"{100 * desk.writing:.0f} %")
    if is_small:
        imgui.set_item_tooltip(text)
    imgui.same_line()
    if imgui.button("stop"):
        stop(desk)
    imgui.set_item_tooltip("stop writing; nothing of the file is left, and what waits is not written")
    desk.panel_state["writing height"] = imgui.get_window_size().y + _MARGIN * scale / 2
    imgui.end()


def stop(desk: Desk) -> None:
    """Stop writing, and say so."""
    name = os.path.basename(str(desk.job.get("path", "")))
    desk.stop_writing()
    desk.say(f"stopped: {name} is not written" if name else "stopped")
