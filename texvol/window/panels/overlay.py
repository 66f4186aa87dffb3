"""What is said over the picture: how fast and how right it is, messages, the keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.scene.display import NUMBER_MODES
from texvol.window.desk import Desk
from texvol.window.quality import error_text, share_text
from texvol.window.steering import BINDINGS, MOUSE

_PLAIN = (
    imgui.WindowFlags_.no_decoration
    | imgui.WindowFlags_.no_nav
    | imgui.WindowFlags_.no_focus_on_appearing
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_inputs
)
_FAULT = imgui.ImVec4(1.0, 0.62, 0.52, 1.0)
_ALPHA = 0.72
_MARGIN = 10.0
_MESSAGES = 3  # at once: more would cover the picture
_MOTION = 3  # pictures: fewer are single changes, and no motion
_WORTH_SAYING = 2.0  # seconds
_BETWEEN = 1 / 60  # seconds: a change is seen in the frame after the one that shows the last picture


def status_height(desk: Desk) -> float:
    """Room that the status takes at the foot of the panels."""
    width = imgui.get_content_region_avail().x
    lines = status_lines(desk)
    spacing = imgui.get_style().item_spacing.y
    needed = sum(imgui.calc_text_size(line, False, width).y + spacing for line in lines) + 2 * spacing if lines else 0.0
    # Never less than before: else whatever is above would move under the mouse.
    height = max(needed, float(desk.panel_state.get("status height", 0.0)))
    desk.panel_state["status height"] = height
    return height


def status(desk: Desk) -> None:
    """Frames per second, slabs, error and what is modelled."""
    lines = status_lines(desk)
    if not lines:
        return
    imgui.separator()
    imgui.push_text_wrap_pos(0.0)
    for line in lines:
        imgui.text_unformatted(line)
    imgui.pop_text_wrap_pos()


def status_lines(desk: Desk) -> list[str]:
    """The lines of the status."""
    shown, document = desk.director.shown, desk.document
    if shown is None or document is None:
        return []
    metadata = shown.metadata
    height, width = shown.pixels.shape[:2]
    slabs = f"{metadata.get('slabs', 0)} slabs"
    numbers = document.scene.mode in NUMBER_MODES
    if shown.state == "moving":
        fraction = 1 / shown.coarseness.shrink if shown.coarseness else 1.0
        first = f"{slabs} · {width} × {height}" + (f" ({fraction:.0%})" if fraction < 1 else "")
    elif shown.state == "refining":
        known = f"{error_text(metadata, numbers=numbers)}, checking" if "reached" in metadata else "refining"
        known += _taken(desk)
        first = f"{known} · {slabs} · {width} × {height}"
    else:
        seconds = metadata.get("seconds", 0.0)
        known = f"{error_text(metadata, numbers=numbers)}{_missed(metadata, numbers=numbers)}"
        first = f"{known} · {slabs} · {width} × {height} · {seconds:.1f} s"
    rate = frames_per_second(desk)
    speed = [f"{rate:.0f} frames/s" + (" while moving" if shown.state != "moving" else "")] if rate else []
    modelled = [*metadata.get("modelled", ())]
    if document.scene.mode == "composite":
        modelled.insert(0, f"{metadata.get('classification', '')} classification")
    return [*speed, first, "modelled: " + ", ".join(modelled)]


def _missed(metadata: Mapping[str, Any], *, numbers: bool) -> str:
    """What is to be said where the error that was wanted is not reached."""
    wanted = metadata.get("wanted_error")
    if metadata.get("reached", True) or wanted is None:
        return ""
    return f", over {wanted:.3g}" if numbers else f", over {share_text(wanted)}"


def _taken(desk: Desk) -> str:
    """How long it has been refined, once that is worth saying."""
    shown = desk.director.shown
    assert shown is not None
    version, since = desk.panel_state.get("refined since", (0, 0.0))
    if version != shown.version:
        since = desk.now
        desk.panel_state["refined since"] = shown.version, since
    seconds = desk.now - since
    return f" for {seconds:.0f} s" if seconds >= _WORTH_SAYING else ""


def frames_per_second(desk: Desk) -> float:
    """New pictures per second when there was something to draw lately; 0 where there never was.

    A pause counts for nothing: a picture shows a change, and what goes before that is no time of its own.
    """
    frames = desk.panel_state.get("frames", [])
    moving = [frame for frame in frames if frame.picture_seconds and frame.state == "moving" and frame.picture > 1]
    taken = [min(frame.picture_seconds, frame.delay + _BETWEEN) for frame in moving if frame.delay]
    if len(taken) >= _MOTION:
        desk.panel_state["rate"] = 1 / float(np.median(taken[-15:]))
    return float(desk.panel_state.get("rate", 0.0))


def messages(desk: Desk) -> None:
    """What was said lately, and what goes on, in the upper left corner."""
    lines = [(each.text, each.is_fault) for each in desk.messages[-_MESSAGES:]]
    if desk.loading is not None:
        lines.append((f"opening {desk.loading.name} …", False))
    elif desk.document is None:
        lines.append(("Drop a volume or a scene here, or open one (F1: keys)", False))
    if desk.writing is not None:
        lines.append((f"writing … {desk.writing:.0%}", False))
    if not lines:
        return
    room = desk.room
    imgui.set_next_window_pos(imgui.ImVec2(room.x + _MARGIN, room.y + _MARGIN))
    imgui.set_next_window_bg_alpha(0.9)
    _texts("messages", lines, max(min(room.width - 5 * _MARGIN, 560), 80))


def probed(desk: Desk) -> None:
    """What is under the cursor, beside it."""
    found, document = desk.probed, desk.document
    if found is None or document is None:
        return
    unit = document.scene.volume.unit
    position = ", ".join(f"{part:.5g}" for part in found.point)
    lines = [(f"value {found.value:.5g}", False), (f"at {position} {unit}".strip(), False)]
    if np.isfinite(found.extinction):
        lines.append((f"extinction {found.extinction:.4g} per {unit or 'unit'}", False))
    x, y = desk.steering.cursor
    room = desk.room
    # To that side of the cursor where there is more room.
    beside = imgui.ImVec2(float(x > room.x + room.width / 2), float(y > room.y + room.height / 2))
    away = 16.0
    imgui.set_next_window_pos(imgui.ImVec2(x + away - 2 * away * beside.x, y + away - 2 * away * beside.y), 0, beside)
    imgui.set_next_window_bg_alpha(_ALPHA)
    _texts("probe", lines, 400)


def _texts(name: str, lines: list[tuple[str, bool]], width: float) -> None:
    """A small window of lines, none wider than so much, in which faults stand out."""
    sizes = [imgui.calc_text_size(text, False, width) for text, _ in lines]
    style = imgui.get_style()
    # Told, because a window that fits itself does so a frame later.
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


def key_text(chord: str) -> str:
    """A chord as it is written on a keyboard."""
    *modifiers, key = chord.split("+")
    if modifiers == ["shift"] and key == "slash":
        return "?"
    is_short = len(key) == 1 or (key[0] == "f" and key[1:].isdigit())
    name = _KEY_NAMES.get(key, key.upper() if is_short else key)
    return " + ".join([*modifiers, name])


def key_rows() -> list[tuple[str, str]]:
    """What mouse and keys are called, and what they do."""
    rows = list(MOUSE)
    for each in BINDINGS:
        chords = each.chords[:1] if "left" in each.chords else each.chords
        rows.append((", ".join(dict.fromkeys(map(key_text, chords))), each.text))
    return rows


def _wide(rows: list[tuple[str, str]]) -> float:
    """What a table of them takes."""
    padding = 2 * imgui.get_style().cell_padding.x
    return sum(max(imgui.calc_text_size(row[side]).x for row in rows) + padding for side in (0, 1))


def keys(desk: Desk) -> None:
    """The page of keys; in two columns where one is too high, and there is room for two; else it scrolls."""
    rows, style = key_rows(), imgui.get_style()
    whole = imgui.get_io().display_size  # the panels may be covered: nobody reads both
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
    room = desk.room
    beside = room.width if size.x <= room.width else whole.x
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
        desk.run("help")
