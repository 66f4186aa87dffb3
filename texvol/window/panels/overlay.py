"""Texts over the picture: messages, the value at the cursor, the table of keys."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui

from texvol.window import commands
from texvol.window.desk import Desk
from texvol.window.panels import parts, readout
from texvol.window.steering import BINDINGS, MOUSE

_PLAIN = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_inputs
_PLAIN |= imgui.WindowFlags_.no_nav | imgui.WindowFlags_.no_focus_on_appearing
_FAULT = imgui.ImVec4(1.0, 0.62, 0.52, 1.0)
_ALPHA = 0.72
_MARGIN, _AWAY = 10.0, 16.0  # window coordinates at scale 1, as are the next three
_WIDEST, _WIDEST_PROBE = 560.0, 400.0
_CELL = 8.0  # beside each text in the table of keys
_MESSAGES = 3  # shown at once


def messages(desk: Desk) -> None:
    """Show recent messages, why there is no picture, and what is being opened, in the upper left corner."""
    lasting = desk.director.why_not_final if desk.document is not None else ""
    lines = [(each.text, each.is_fault) for each in desk.messages[-_MESSAGES:] if each.text != lasting]
    if lasting:
        lines.append((lasting, True))
    if desk.loading is not None:
        lines.append((f"opening {desk.loading.name} …", False))
    if not lines:
        return
    viewport = desk.viewport
    scale = parts.scale()
    margin = _MARGIN * scale
    below = float(desk.panel_state.get("writing height", 0.0))
    imgui.set_next_window_pos(imgui.ImVec2(viewport.x + margin, viewport.y + margin + below))
    imgui.set_next_window_bg_alpha(0.9)
    _texts("messages", lines, max(min(viewport.width - 5 * margin, _WIDEST * scale), 80))


def probed(desk: Desk) -> None:
    """Show the values of all volumes beside the cursor."""
    found, document = desk.probed or desk.layout.hovered, desk.document
    if found is None or document is None:
        return
    lines = [(line, False) for line in readout.lines(document.scene, found, index=True)]
    if np.isfinite(found.extinction):
        lines.append((f"extinction {found.extinction:.4g} per {document.scene.volume.unit or 'unit'}", False))
    x, y = desk.steering.cursor
    viewport = desk.layout.area
    # On the side of the cursor with more room.
    beside = imgui.ImVec2(float(x > viewport.x + viewport.width / 2), float(y > viewport.y + viewport.height / 2))
    away = _AWAY * parts.scale()
    imgui.set_next_window_pos(imgui.ImVec2(x + away - 2 * away * beside.x, y + away - 2 * away * beside.y), 0, beside)
    imgui.set_next_window_bg_alpha(_ALPHA)
    _texts("probe", lines, _WIDEST_PROBE * parts.scale())


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
    "comma": ",", "period": ".",
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
        names = "arrows" if "left" in each.chords else ", ".join(dict.fromkeys(map(_key_text, each.chords)))
        rows.append((names, each.text))
    return rows


def _wide(rows: list[tuple[str, str]]) -> float:
    """Return the width of a table of rows."""
    padding = 2 * imgui.get_style().cell_padding.x
    return sum(max(imgui.calc_text_size(row[side]).x for row in rows) + padding for side in (0, 1))


def keys(desk: Desk) -> None:
    """Show the table of keys, in two columns if one column is too high and two columns fit; else it scrolls."""
    rows, style = _key_rows(), imgui.get_style()
    imgui.push_style_var(imgui.StyleVar_.cell_padding, imgui.ImVec2(_CELL * parts.scale(), style.cell_padding.y))
    whole = imgui.get_io().display_size  # the table may cover the side panel
    line = imgui.get_text_line_height() + 2 * style.cell_padding.y
    margin = 2 * style.window_padding.x
    title = imgui.get_frame_height() + 2 * style.window_padding.y
    half = -(-len(rows) // 2)
    between = 2 * style.cell_padding.x  # an empty column
    both = _wide(rows[:half]) + between + _wide(rows[half:]) + margin
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
    if imgui.begin_table("keys", 3 * columns - 1, imgui.TableFlags_.sizing_fixed_fit):
        for number in range(each):
            imgui.table_next_row()
            for half, (name, text) in enumerate(rows[number::each]):
                imgui.table_set_column_index(3 * half)
                imgui.text_colored(imgui.ImVec4(0.55, 0.78, 1.0, 1.0), name)
                imgui.table_next_column()
                imgui.text_unformatted(text)
        imgui.end_table()
    imgui.end()
    imgui.pop_style_var()
    if not stays:
        commands.run(desk, "help")
