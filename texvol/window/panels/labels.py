"""Labels of a segmentation in the Medium tab: visibility, colour, name and opacity of each, with a search."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from imgui_bundle import imgui

from texvol.scene.label_names import names_of, table_of
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.labels import OPACITY, LabelLook, label_function
from texvol.window import editing, label_looks
from texvol.window.desk import Desk
from texvol.window.panels import parts

_SLIDER = 64.0  # window coordinates at scale 1
_LEAST_ROWS = 6.0
_COLUMNS = 5
_ALL, _NONE, _NAMES = "show all", "hide all", "names …"


def show(desk: Desk, scene: Scene, medium: TransferFunction, number: int) -> None:
    """Show the search, and a row for each label that it finds."""
    volume, state = scene.volumes[number], desk.panel_state
    if state.get("look_of") is not medium:
        state["look_of"], state["look"] = medium, label_looks.look_of(medium, volume)
    look: LabelLook = state["look"]
    known = names_of(volume, look.opacities)
    imgui.set_next_item_width(-1)
    _, state["label search"] = imgui.input_text_with_hint("##search", "search a name or a number", _sought(state))
    imgui.set_item_tooltip("only labels with all of these words in their names, or with this number, are listed")
    found = label_looks.matching(look.opacities, known, _sought(state))
    pressed = parts.buttons((_ALL, _NONE, _NAMES), 3)
    opacities = dict(look.opacities)
    if pressed in (_ALL, _NONE):
        opacities = label_looks.with_shown(opacities, found, shown=pressed == _ALL)
    elif pressed == _NAMES:
        desk.browse("Names of labels", lambda path, _: label_looks.take_names(desk, number, path))
    _note(scene, number, len(found), len(look.opacities) - (0 in look.opacities))
    if state.get("label before", (None,))[0] is not volume:
        state["label before"] = volume, None
    opacities, colors = _table(state, found, known, look._replace(opacities=opacities))
    if opacities != look.opacities or colors != look.colors:
        made = replace(label_function(volume, opacities, colors), name=medium.name)
        # All changes of one drag are one step of the history.
        desk.change("labels", **editing.with_own(scene, number, transfer_function=made))


def _sought(state: Mapping[str, Any]) -> str:
    return str(state.get("label search", ""))


def _note(scene: Scene, number: int, found: int, count: int) -> None:
    """Show how many labels are listed, and where their names come from."""
    table = table_of(scene.volumes[number])
    source = "" if table is None or not table.source else f", names from {os.path.basename(table.source)}"
    parts.note((f"{count} labels" if found == count else f"{found} of {count} labels") + source)


def _table(
    state: dict[str, Any], found: list[int], names: Mapping[int, str], look: LabelLook
) -> tuple[dict[int, float], dict[int, parts.Color]]:
    """Show the rows of labels; return all opacities and colours. Only rows in sight are made."""
    opacities, colors, scale = dict(look.opacities), dict(look.colors), parts.scale()
    row = imgui.get_frame_height_with_spacing()
    tall = max(imgui.get_content_region_avail().y, _LEAST_ROWS * row)
    flags = imgui.TableFlags_.scroll_y | imgui.TableFlags_.sizing_fixed_fit
    if not imgui.begin_table("labels", _COLUMNS, flags, imgui.ImVec2(0, tall)):
        return opacities, colors
    for name in ("shown", "color", "name", "opacity", "alone"):
        is_name, is_slider = name == "name", name == "opacity"
        how = imgui.TableColumnFlags_.width_stretch if is_name else imgui.TableColumnFlags_.width_fixed
        imgui.table_setup_column(name, how, _SLIDER * scale if is_slider else 0.0)
    clipper = imgui.ListClipper()
    clipper.begin(len(found), row)
    while clipper.step():
        for label in found[clipper.display_start : clipper.display_end]:
            imgui.table_next_row()
            imgui.push_id(label)
            opacities[label], colors[label] = _row(label, names.get(label, ""), opacities[label], colors[label])
            imgui.table_next_column()
            if _solo(label_looks.is_alone(opacities, label)):
                volume, before = state["label before"]
                opacities, before = label_looks.alone(opacities, label, before)
                state["label before"] = volume, before
            imgui.pop_id()
    clipper.end()
    imgui.end_table()
    return opacities, colors


def _row(label: int, name: str, opacity: float, color: parts.Color) -> tuple[float, parts.Color]:
    """Show the row of a label but for its last column; return its opacity and colour."""
    imgui.table_next_column()
    visible = parts.switch("##shown", opacity > 0)
    imgui.table_next_column()
    color = parts.color("##color", color, small=True)
    imgui.table_next_column()
    imgui.align_text_to_frame_padding()
    text = parts.fitting(name or f"label {label}", imgui.get_content_region_avail().x)
    imgui.text_unformatted(text) if opacity > 0 else imgui.text_disabled(text)
    imgui.set_item_tooltip(f"label {label}" + (f": {name}" if name else ""))
    imgui.table_next_column()
    imgui.set_next_item_width(-1)
    wanted = parts.slider("##label opacity", opacity, 0.0, 1.0, "%.2f")
    if visible != (opacity > 0):
        wanted = OPACITY if visible else 0.0
    return wanted, color


def _solo(is_alone: bool) -> bool:
    """Show the button that shows one label alone; return True if it was pressed."""
    if is_alone:
        imgui.push_style_color(imgui.Col_.button.value, imgui.get_style_color_vec4(imgui.Col_.button_active.value))
    pressed = bool(imgui.button("solo"))
    if is_alone:
        imgui.pop_style_color()
    imgui.set_item_tooltip("show all others again as they were" if is_alone else "show this label alone")
    return pressed
