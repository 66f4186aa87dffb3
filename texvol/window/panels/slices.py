"""Axial, coronal and sagittal slices with a crosshair, window and level."""

from __future__ import annotations

from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.transfer import TransferFunction
from texvol.volume import Volume
from texvol.window import navigation, probe
from texvol.window.desk import Desk
from texvol.window.panels import parts
from texvol.window.slices import NAMES, Slice, grey, painted, slices_of, typical_window

_LINE = 0xB0_50_D0_FF  # a thin amber, ABGR
_LEAST = 60.0  # window coordinates


def show(desk: Desk) -> None:
    """The tab."""
    document = desk.document
    if document is None:
        imgui.text_disabled("Nothing is open.")
        return
    volume, matter, state = document.scene.volume, document.scene.transfer_function, desk.panel_state
    if not volume.labels:
        matter = None
    if state.get("sliced") is not volume:
        state["sliced"], state["slices"] = volume, slices_of(volume)
        state["window"] = typical_window(volume)
        state["crosshair"] = (np.array(volume.dimensions) - 1) / 2
    if matter is None:
        _window(state, volume)
    index = state["crosshair"]
    available = imgui.get_content_region_avail()
    text = imgui.get_text_line_height_with_spacing()
    each = max((available.y - 4 * text - 40) / 3, _LEAST)
    for name in NAMES:
        _slice(desk, name, state["slices"][name], volume, matter, imgui.ImVec2(available.x, each))
    here = volume.origin + volume.world_from_index @ index
    place = ", ".join(f"{part:.5g}" for part in here)
    found = probe.at_point(document.scene, here)
    imgui.text_unformatted(f"{place} {volume.unit}".strip() + f":  {found.value:.5g}")
    if imgui.button("turn about the crosshair"):
        document.look(navigation.with_pivot(document.view, here))


def _window(state: dict[str, Any], volume: Volume) -> None:
    low, high = volume.finite_range or (0.0, 1.0)
    centre, width = state["window"]
    moved, centre = parts.slider("level", centre, low, high)
    wider, width = parts.slider("window", width, 1e-3 * (high - low), 2 * (high - low))
    if moved or wider:
        state["window"] = centre, max(width, 1e-300)


def _texture(desk: Desk, name: str, slice_: Slice, volume: Volume, matter: TransferFunction | None, number: int) -> int:
    """The slice's picture: grey, or by the transfer function of labels."""
    window = desk.panel_state["window"]

    def make() -> Any:
        values = slice_.values(volume, number)
        return grey(values, window) if matter is None else painted(values, matter)

    return desk.texture(name, (id(volume), number, window if matter is None else matter), make)


def _slice(desk: Desk, name: str, slice_: Slice, volume: Volume, matter: TransferFunction | None, room: Any) -> None:
    """One slice, as large as the room lets it be; a drag in it moves the crosshair."""
    state = desk.panel_state
    index = state["crosshair"]
    number = round(float(index[slice_.axis]))
    texture = _texture(desk, name, slice_, volume, matter, number)
    width, height = slice_.extent(volume)
    scale = min(room.x / width, room.y / height)
    size = imgui.ImVec2(max(width * scale, 1), max(height * scale, 1))
    start = imgui.get_cursor_screen_pos()
    start = imgui.ImVec2(start.x + (room.x - size.x) / 2, start.y)
    draw = imgui.get_window_draw_list()
    end = imgui.ImVec2(start.x + size.x, start.y + size.y)
    draw.add_image(imgui.ImTextureRef(texture), start, end)
    right, down = slice_.shares(volume, index)
    x, y = start.x + right * size.x, start.y + down * size.y
    draw.add_line(imgui.ImVec2(x, start.y), imgui.ImVec2(x, end.y), _LINE)
    draw.add_line(imgui.ImVec2(start.x, y), imgui.ImVec2(end.x, y), _LINE)
    draw.add_text(imgui.ImVec2(start.x + 5, start.y + 3), 0xFF_FF_FF_FF, f"{name} {number}")
    imgui.set_cursor_screen_pos(start)
    imgui.invisible_button(name, size)
    if imgui.is_item_active():
        mouse = imgui.get_io().mouse_pos
        state["crosshair"] = slice_.moved(volume, index, (mouse.x - start.x) / size.x, (mouse.y - start.y) / size.y)
    elif imgui.is_item_hovered() and imgui.get_io().mouse_wheel:
        count = volume.dimensions[slice_.axis]
        moved = np.array(index)
        moved[slice_.axis] = np.clip(number + np.sign(imgui.get_io().mouse_wheel), 0, count - 1)
        state["crosshair"] = moved
