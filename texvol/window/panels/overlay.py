"""Texts over the picture and at the foot of the side panel: frame rate and error, messages, table of keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.scene.display import NUMBER_MODES
from texvol.window import commands
from texvol.window.desk import Desk
from texvol.window.quality import error_text, limit_text
from texvol.window.stand_in import StandIn
from texvol.window.steering import BINDINGS, MOUSE

_PLAIN = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_inputs
_PLAIN |= imgui.WindowFlags_.no_nav | imgui.WindowFlags_.no_focus_on_appearing
_FAULT = imgui.ImVec4(1.0, 0.62, 0.52, 1.0)
_ALPHA = 0.72
_MARGIN = 10.0
_MESSAGES = 3  # shown at once
_MOTION = 3  # pictures: fewer are single changes
_WORTH_SHOWING = 2.0  # seconds
_BETWEEN = 1 / 60  # seconds: a change is noticed in the frame after the one that shows the last picture


def status_height(desk: Desk, lines: list[str]) -> float:
    """Return the height of the status lines at the foot of the panel."""
    width = imgui.get_content_region_avail().x
    spacing = imgui.get_style().item_spacing.y
    heights = [imgui.calc_text_size(line, False, width).y + spacing for line in lines]
    needed = sum(heights) + 2 * spacing if lines else 0.0
    # The height never decreases, because the controls above would move under the mouse.
    height = max(needed, float(desk.panel_state.get("status height", 0.0)))
    desk.panel_state["status height"] = height
    return height


def status_lines(desk: Desk) -> list[str]:
    """Return lines of text: frames per second; slabs and error; what is modelled."""
    shown, document = desk.director.shown, desk.document
    if shown is None or document is None:
        return []
    metadata = shown.metadata
    height, width = shown.pixels.shape[:2]
    first = f"{metadata.get('slabs', 0)} slabs · {width} × {height}{_level_text(desk, metadata)}"
    numbers = document.scene.mode in NUMBER_MODES
    error = error_text(metadata, numbers=numbers)
    if shown.state == "moving":
        fraction = 1 / shown.coarseness.shrink if shown.coarseness else 1.0
        first += f" ({fraction:.0%})" if fraction < 1 else ""
    elif shown.state == "refining":
        known = f"{error}, checking" if "reached" in metadata else "refining"
        first = f"{known}{_refining_time(desk)} · {first}"
    else:
        if "wanted_error" in metadata and not metadata.get("reached", True):
            error += f", over {limit_text(metadata['wanted_error'], numbers=numbers)}"
        first = f"{error} · {first} · {metadata.get('seconds', 0.0):.1f} s"
    rate = _frames_per_second(desk)
    speed = [f"{rate:.0f} frames/s" + (" while moving" if shown.state != "moving" else "")] if rate else []
    modelled = [*metadata.get("modelled", ())]
    if document.scene.mode == "composite":
        modelled.insert(0, f"{metadata.get('classification', '')} classification")
    return [*speed, first, "modelled: " + ", ".join(modelled)]


def _level_text(desk: Desk, metadata: Mapping[str, Any]) -> str:
    """Return which level of a store is shown; nothing for other volumes."""
    assert desk.document is not None
    volume = desk.document.scene.volume
    if not isinstance(volume, StandIn):
        return ""
    return f" · level {metadata.get('level', volume.level)} of 0 to {len(volume.large.levels) - 1}"


def _refining_time(desk: Desk) -> str:
    """Return a text about the time of refining, if it is longer than a moment."""
    shown = desk.director.shown
    assert shown is not None
    version, since = desk.panel_state.get("refined since", (0, 0.0))
    if version != shown.version:
        since = desk.now
        desk.panel_state["refined since"] = shown.version, since
    seconds = desk.now - since
    return f" for {seconds:.0f} s" if seconds >= _WORTH_SHOWING else ""


def _frames_per_second(desk: Desk) -> float:
    """Return new pictures per second during the last motion; 0 before the first motion.

    Pauses do not count: the time of a picture begins with the change that it shows.
    """
    frames = desk.panel_state.get("frames", [])
    moving = [frame for frame in frames if frame.picture_seconds and frame.state == "moving" and frame.picture > 1]
    taken = [min(frame.picture_seconds, frame.delay + _BETWEEN) for frame in moving if frame.delay]
    if len(taken) >= _MOTION:
        desk.panel_state["rate"] = 1 / float(np.median(taken[-15:]))
    return float(desk.panel_state.get("rate", 0.0))


def messages(desk: Desk) -> None:
    """Show recent messages and the progress of reading and writing in the upper left corner."""
    lines = [(each.text, each.is_fault) for each in desk.messages[-_MESSAGES:]]
    if desk.loading is not None:
        lines.append((f"opening {desk.loading.name} …", False))
    if desk.writing is not None:
        left = desk.moving.left.text(desk.now)
        lines.append((f"writing … {desk.writing:.0%}" + (f", {left}" if left else ""), False))
    if not lines:
        return
    viewport = desk.viewport
    imgui.set_next_window_pos(imgui.ImVec2(viewport.x + _MARGIN, viewport.y + _MARGIN))
    imgui.set_next_window_bg_alpha(0.9)
    _texts("messages", lines, max(min(viewport.width - 5 * _MARGIN, 560), 80))


def probed(desk: Desk) -> None:
    """Show the probed value beside the cursor."""
    found, document = desk.probed, desk.document
    if found is None or document is None:
        return
    unit = document.scene.volume.unit
    position = ", ".join(f"{part:.5g}" for part in found.point)
    lines = [(f"value {found.value:.5g}", False), (f"at {position} {unit}".strip(), False)]
    if np.isfinite(found.extinction):
        lines.append((f"extinction {found.extinction:.4g} per {unit or 'unit'}", False))
    x, y = desk.steering.cursor
    viewport = desk.viewport
    # On the side of the cursor with more room.
    beside = imgui.ImVec2(float(x > viewport.x + viewport.width / 2), float(y > viewport.y + viewport.height / 2))
    away = 16.0
    imgui.set_next_window_pos(imgui.ImVec2(x + away - 2 * away * beside.x, y + away - 2 * away * beside.y), 0, beside)
    imgui.set_next_window_bg_alpha(_ALPHA)
    _texts("probe", lines, 400)


def _texts(name: str, lines: list[tuple[str, bool]], width: float) -> None:
    """Show lines of text in a small window, wrapped at a width; faults have another colour."""
    sizes = [imgui.calc_text_size(text, False, width) for text, _ in lines]
    style = imgui.get_style()
    # The size is set, because a window that fits itself has its new size one frame late.
    inner = sum(size.y for size in sizes) + style.item_spacing.y * (len(sizes) - 1)
    widest = max(size.x for size in sizes)
    imgui.set_next_window_size(
        imgui.ImVec2(widest + 2 * style.window_padding.x + 1, inner + 2 * style.window_padding.y + 1)
    )
    imgui.begin(name, None, _PLAIN)
    imgui.push_text_wrap_pos(style.window_padding.x + widest + 1)
    for text, is_fault in lines:
        if is_fault:
            imgui.push_style_color(imgui.Col_.text.value, _FAULT)
        imgui.text_unformatted(text)
        if is_fault:
            imgui.pop_style_color()
    imgui.pop_text_wrap_pos()
    imgui.end()


_KEY_NAMES = {
    "slash": "?", "left_bracket": "[", "right_bracket": "]", "page_up": "page up", "page_down": "page down",
    "left": "arrows",
}  # fmt: skip


def _key_text(chord: str) -> str:
    """Return a chord as it is printed on keys."""
    *modifiers, key = chord.split("+")
    if modifiers == ["shift"] and key == "slash":
        return "?"
    is_short = len(key) == 1 or (key[0] == "f" and key[1:].isdigit())
    name = _KEY_NAMES.get(key, key.upper() if is_short else key)
    return " + ".join([*modifiers, name])


def _key_rows() -> list[tuple[str, str]]:
    """Return the names of mouse actions and keys, with their descriptions."""
    rows = list(MOUSE)
    for each in BINDINGS:
        chords = each.chords[:1] if "left" in each.chords else each.chords
        rows.append((", ".join(dict.fromkeys(map(_key_text, chords))), each.text))
    return rows


def _wide(rows: list[tuple[str, str]]) -> float:
    """Return the width of a table of rows."""
    padding = 2 * imgui.get_style().cell_padding.x
    return sum(max(imgui.calc_text_size(row[side]).x for row in rows) + padding for side in (0, 1))


def keys(desk: Desk) -> None:
    """Show the table of keys, in two columns if one column is too high and two columns fit; else it scrolls."""
    rows, style = _key_rows(), imgui.get_style()
    whole = imgui.get_io().display_size  # the table may cover the side panel
    line = imgui.get_text_line_height() + 2 * style.cell_padding.y
    margin = 2 * style.window_padding.x
    title = imgui.get_frame_height() + 2 * style.window_padding.y
    half = -(-len(rows) // 2)
    both = _wide(rows[:half]) + _wide(rows[half:]) + margin
    columns = 2 if title + line * len(rows) > whole.y and both <= whole.x else 1
    each = half if columns == 2 else len(rows)
    needed = title + line * each + style.item_spacing.y
    wide = both if columns == 2 else _wide(rows) + margin + (style.scrollbar_size if needed > whole.y else 0)
    size = imgui.ImVec2(min(wide, max(whole.x, 1)), min(needed, max(whole.y, 1)))
    viewport = desk.viewport
    beside = viewport.width if size.x <= viewport.width else whole.x
    imgui.set_next_window_pos(imgui.ImVec2(max((beside - size.x) / 2, 0), max((whole.y - size.y) / 2, 0)))
    imgui.set_next_window_size(size)
    flags = imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_resize
    _, stays = imgui.begin("Keys and mouse", True, flags)
    if imgui.begin_table("keys", 2 * columns, imgui.TableFlags_.sizing_fixed_fit):
        for number in range(each):
            imgui.table_next_row()
            for name, text in rows[number::each]:
                imgui.table_next_column()
                imgui.text_colored(imgui.ImVec4(0.55, 0.78, 1.0, 1.0), name)
                imgui.table_next_column()
                imgui.text_unformatted(text)
        imgui.end_table()
    imgui.end()
    if not stays:
        commands.run(desk, "help")
