"""List of volumes in the Scene tab: eye, colour, opacity, labels, place and mask of each."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from imgui_bundle import imgui

from texvol.scene.volume import Volume
from texvol.window import commands, list_editing, opening, placing, volume_list
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.naming import volume_called
from texvol.window.panels import icons, masks, parts
from texvol.window.tinting import tint_of
from texvol.window.volume_list import Entry

Act = Callable[[], object]

_MOST_OPACITY = 200.0  # per cent, on the slider
_CONTROL = 0.5  # width of a slider as a fraction of the panel's
_MOST_CHANNELS = 64  # in the list of those that can be added


def show(desk: Desk, document: Document) -> None:
    """Show all volumes of the scene, hidden ones included."""
    found = list_editing.entries(document)
    acts: list[Act] = []  # done when the list is shown: it is that of the scene until then
    for number in range(len(found)):
        imgui.push_id(number)
        _volume(desk, document, found, number, acts)
        imgui.pop_id()
        if number + 1 < len(found):
            imgui.spacing()
            imgui.separator()
    _channels(desk, document, found)
    for act in acts:
        desk.attempt(act)


def _volume(desk: Desk, document: Document, found: list[Entry], number: int, acts: list[Act]) -> None:
    """Show one volume of the list; changes of it are added to `acts`."""
    entry = found[number]
    volume, composite = entry.owner.volume, document.scene.mode == "composite"
    _head(desk, document, found, number, acts)
    size = " x ".join(map(str, volume.dimensions))
    kind = ", labels" if volume.labels else ", colours" if volume.colors is not None else ""
    imgui.text_disabled(f"{size} {volume.dtype}{kind}" + (f", {volume.unit}" if volume.unit else ""))
    if composite and entry.owner.transfer_function is not None:
        _opacity(desk, document, number, entry, acts)
    if volume.colors is None and not volume.blocks and composite:
        on = parts.switch("as labels", volume.labels)
        if on != volume.labels and desk.loading is None:
            acts.append(lambda: list_editing.set_labels(desk, document, number, on))
        if entry.shown:
            imgui.same_line()
    if entry.shown:
        among = volume_list.number_among_shown(found, number)
        if composite:
            if imgui.button("transfer function"):
                desk.panel_state["volume"] = among
                commands.run(desk, "tab Medium")
            imgui.set_item_tooltip("edit the transfer function of this volume")
            imgui.same_line()
        masks.show(desk, document.scene, volume, among)
    opened = imgui.tree_node("spacing and transform")
    imgui.set_item_tooltip("distance of the samples, and where the volume lies in the world")
    if opened:
        _place(desk, document, number, volume, acts)
        imgui.tree_pop()


def _head(desk: Desk, document: Document, found: list[Entry], number: int, acts: list[Act]) -> None:
    """Show the first line of a volume: eye, colour, name, and a button that takes it out."""
    entry = found[number]
    volume, composite = entry.owner.volume, document.scene.mode == "composite"
    imgui.begin_disabled(not composite and entry.shown)
    if icons.button("##eye", "eye" if entry.shown else "hidden", dim=not entry.shown):
        acts.append(lambda: list_editing.toggle(desk, document, number))
    if imgui.is_item_clicked(1):
        acts.append(lambda: list_editing.solo(desk, document, number))
    more = "\nright click: this volume alone; once more, all volumes" if len(found) > 1 else ""
    imgui.set_item_tooltip(f"{'hide this volume; it stays in the list' if entry.shown else 'show this volume'}{more}")
    imgui.end_disabled()
    imgui.same_line()
    if not volume.labels and volume.colors is None and composite and entry.owner.transfer_function is not None:
        _color(desk, document, number, entry, acts)
        imgui.same_line()
    taken = "remove"
    room = imgui.calc_text_size(taken).x + 2 * imgui.get_style().frame_padding.x + imgui.get_style().item_spacing.x
    left = imgui.get_content_region_avail().x - room
    name = parts.fitting(f"{number + 1}: {volume_called(volume)}", left)
    imgui.align_text_to_frame_padding()
    start = imgui.get_cursor_pos_x()
    if entry.shown:
        imgui.text_unformatted(name)
    else:
        imgui.text_disabled(name)
    imgui.set_item_tooltip(f"{volume_called(volume)}\n{volume.source.get('absolute', volume.name)}")
    imgui.same_line(start + left + imgui.get_style().item_spacing.x)
    imgui.begin_disabled(len(found) == 1)
    if imgui.button(taken):
        acts.append(lambda: list_editing.remove(desk, document, number))
    imgui.set_item_tooltip("take this volume out of the scene; undo brings it back")
    imgui.end_disabled()


def _color(desk: Desk, document: Document, number: int, entry: Entry, acts: list[Act]) -> None:
    """Show the colour that stands for a volume; another one makes it one hue."""
    medium = entry.owner.medium
    tint = tint_of(medium)
    color = parts.color("##color", tint.shown_color, small=True)
    own = "" if tint.color is None else "\nright click: its own colours again"
    imgui.set_item_tooltip(f"colour of the whole volume; a click opens the choice{own}")
    if tint.color is not None and imgui.is_item_clicked(1):
        acts.append(lambda: list_editing.set_color(desk, document, number, None))
    elif color != tint.shown_color:
        acts.append(lambda: list_editing.set_color(desk, document, number, color))


def _opacity(desk: Desk, document: Document, number: int, entry: Entry, acts: list[Act]) -> None:
    factor = 100 * tint_of(entry.owner.medium).opacity
    imgui.set_next_item_width(_CONTROL * imgui.get_content_region_avail().x)
    changed, wanted = imgui.slider_float("opacity##volume", factor, 0.0, max(_MOST_OPACITY, factor), "%.0f %%")
    imgui.set_item_tooltip("how dense the volume is, compared with its transfer function; a double click resets it")
    if imgui.is_item_hovered() and imgui.is_mouse_double_clicked(0):
        changed, wanted = factor != 100, 100.0
    if changed and wanted >= 0:  # an unchanged number differs from `factor` by the rounding to single precision
        acts.append(lambda: list_editing.set_opacity(desk, document, number, wanted / 100))


def _place(desk: Desk, document: Document, number: int, volume: Volume, acts: list[Act]) -> None:
    """Show the spacing, and the transform with buttons that read and reset it."""
    spacing = placing.spacing_of(volume)
    imgui.set_next_item_width(-1)
    flags = imgui.InputTextFlags_.enter_returns_true
    changed, wanted = imgui.input_float3("##spacing", list(spacing), "%.5g", flags)
    imgui.set_item_tooltip(f"distance of samples along x, y, z in {volume.unit or 'units'}; Enter applies it")
    if changed and np.isfinite(wanted).all() and tuple(wanted) != spacing:
        exact = [float(f"{each:.7g}") for each in wanted]  # as it was typed: the field is of single precision
        acts.append(lambda: list_editing.set_spacing(desk, document, number, exact))
    matrix = placing.transform_of(volume)
    moved = not np.allclose(matrix, np.eye(4), rtol=0, atol=1e-12)
    imgui.align_text_to_frame_padding()
    imgui.text_unformatted("transform: " + ("moved" if moved else "none"))
    if moved:
        imgui.set_item_tooltip("\n".join("  ".join(f"{each:9.4g}" for each in row) for row in matrix))
    imgui.same_line()
    if imgui.button("from a file …"):
        desk.browse(
            "Transform of the volume: 4 rows of 4 numbers",
            lambda path, _: list_editing.set_transform(desk, document, number, path),
        )
    imgui.set_item_tooltip("a text file with the 12 or 16 numbers of a matrix, which moves the volume in the world")
    imgui.same_line()
    imgui.begin_disabled(not moved)
    if imgui.button("reset"):
        acts.append(lambda: list_editing.set_transform(desk, document, number, None))
    imgui.set_item_tooltip("back to where the volume's own file says")
    imgui.end_disabled()


def _channels(desk: Desk, document: Document, found: list[Entry]) -> None:
    """Show a choice of the channels of the first volume's image that are not in the list."""
    volume = found[0].owner.volume
    path = volume.source.get("absolute")
    held = {each.owner.volume.channel for each in found if each.owner.volume.source.get("absolute") == path}
    others = [each for each in volume.channels if each not in held][:_MOST_CHANNELS]
    if not others or path is None or document.scene.mode != "composite":
        return
    imgui.separator()
    names = ["add a channel …", *(f"{each.number} {each.name}".rstrip() for each in others)]
    imgui.set_next_item_width(-1)
    marked, chosen = 0, False
    if imgui.begin_combo("##channel", names[0], imgui.ComboFlags_.height_large):
        if imgui.is_window_appearing():
            desk.panel_state["channel marked"] = 0
        marked, chosen = parts.listed(names, desk.panel_state.get("channel marked", 0))
        desk.panel_state["channel marked"] = marked
        imgui.end_combo()
    imgui.set_item_tooltip("further channels of the file of the first volume")
    if chosen and marked > 0:
        opening.add(desk, path, opening.like(volume) | {"channel": others[marked - 1].number})
