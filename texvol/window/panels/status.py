"""Foot of the panel: whether the picture is final, and on demand its error, its slabs and what is modelled."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.scene.display import NUMBER_MODES
from texvol.window import commands
from texvol.window.desk import Desk
from texvol.window.panels import parts
from texvol.window.quality import error_text, limit_text
from texvol.window.stand_in import StandIn

_MOTION = 3  # pictures: fewer are single changes
_BETWEEN = 1 / 60  # seconds: a change is noticed in the frame after the one that shows the last picture
_FEWEST_LINES = 4  # of the details, for which room is kept


def height(desk: Desk) -> float:
    """Return the height of the foot, which is the same whatever is said, because the controls above would move."""
    style = imgui.get_style()
    line = imgui.get_frame_height() + 2 * style.item_spacing.y
    if not desk.preferences.details:
        return line
    width, spacing = imgui.get_content_region_avail().x, style.item_spacing.y
    needed = sum(imgui.calc_text_size(each, False, width).y + spacing for each in details(desk))
    least = _FEWEST_LINES * imgui.get_text_line_height_with_spacing()
    # Longer texts make room once; the room stays.
    room = max(needed, least, float(desk.panel_state.get("details height", 0.0)))
    desk.panel_state["details height"] = room
    return line + room


def show(desk: Desk) -> None:
    """Show the foot."""
    imgui.separator()
    shown, style = state(desk), imgui.get_style()
    label = "details"
    button = imgui.calc_text_size(label).x + 2 * style.frame_padding.x
    imgui.align_text_to_frame_padding()
    imgui.text_unformatted(shown)
    rate = _frames_per_second(desk)
    text = f"{rate:.0f} frames/s"
    place = imgui.get_content_region_avail().x - button - imgui.calc_text_size(text).x - style.item_spacing.x
    if rate and place > imgui.calc_text_size(shown).x + 2 * style.item_spacing.x:  # else the panel is too narrow
        imgui.same_line(place)
        imgui.text_disabled(text)
    imgui.same_line(max(imgui.get_content_region_avail().x - button, 0.0) + style.window_padding.x)
    if parts.pressed_toggle(label, desk.preferences.details):
        commands.run(desk, label)
    if desk.preferences.details:
        for line in details(desk):
            imgui.text_wrapped(line)


def state(desk: Desk) -> str:
    """Return in plain words how far the picture is."""
    director = desk.director
    if desk.document is not None and director.why_not_final:
        return "no final picture"
    if director.shown is None or desk.document is None:
        return ""
    if director.at_rest:
        return "final"
    if not director.refining:
        return "moving"
    return f"refining {100 * director.refined:.0f} %" if director.refined > 0 else "refining"


def details(desk: Desk) -> list[str]:
    """Return lines about the picture: its error; slabs, size and time; what is modelled."""
    shown, document = desk.director.shown, desk.document
    if shown is None or document is None:
        return []
    metadata = shown.metadata
    rows, columns = shown.pixels.shape[:2]
    numbers = document.scene.mode in NUMBER_MODES
    fraction = 1 / shown.coarseness.shrink if shown.coarseness else 1.0
    size = f"{columns} × {rows} pixels" + (f" ({100 * fraction:.0f} %)" if fraction < 1 else "")
    drawn = f"{metadata.get('slabs', 0)} slabs · {size}{_level_text(desk, metadata)}"
    if shown.state == "rest":
        drawn += f" · {metadata.get('seconds', 0.0):.1f} s"
    modelled = [*metadata.get("modelled", ())]
    if document.scene.mode == "composite":
        modelled.insert(0, f"{metadata.get('classification', '')} classification")
    return [_error_text(shown.state, metadata, numbers=numbers), drawn, "modelled: " + ", ".join(modelled)]


def _error_text(state: str, metadata: Mapping[str, Any], *, numbers: bool) -> str:
    if state == "moving":
        return "a quick picture while something changes"
    text = error_text(metadata, numbers=numbers)
    if state == "refining":
        return f"{text}, checking" if "reached" in metadata else "error not known yet"
    if "wanted_error" in metadata and not metadata.get("reached", True):
        text += f", over {limit_text(metadata['wanted_error'], numbers=numbers)}"
    return text


def _level_text(desk: Desk, metadata: Mapping[str, Any]) -> str:
    """Return which level of a store is shown; nothing for other volumes."""
    assert desk.document is not None
    volume = desk.document.scene.volume
    if not isinstance(volume, StandIn):
        return ""
    return f" · level {metadata.get('level', volume.level)} of 0 to {len(volume.large.levels) - 1}"


def _frames_per_second(desk: Desk) -> float:
    """Return the pictures per second while something moves; 0 before there were enough of them."""
    frames = desk.panel_state.get("frames", [])
    moving = [frame for frame in frames if frame.picture_seconds and frame.state == "moving" and frame.picture > 1]
    taken = [min(frame.picture_seconds, frame.delay + _BETWEEN) for frame in moving if frame.delay]
    if len(taken) >= _MOTION:
        desk.panel_state["rate"] = 1 / float(np.median(taken[-15:]))
    return float(desk.panel_state.get("rate", 0.0))
