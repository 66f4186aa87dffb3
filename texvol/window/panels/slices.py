"""Axial, coronal and sagittal slices with a crosshair, window and level; one of them fills the panel if it is wanted.

They lie beside or under each other, as they are largest; where all of them would be small in a low window, each is as
wide as the panel, and the panel scrolls.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.window import handles, navigation, probe
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.panels import parts
from texvol.window.slices import NAMES, Slice, grey, letters_of, painted, slices_of, tiled, typical_window

_LINE = 0xB0_50_D0_FF  # a thin amber, ABGR
_LEAST = 60.0  # window coordinates
_LEAST_SLICE = 80.0  # window coordinates: its title has to find room
_GAP = 6.0
_ARM = 14.0  # of the cross in the picture
_WINDOWING = 300.0  # window coordinates: a drag of so many goes through all values
_SIDES = ((0.0, 0.5), (1.0, 0.5), (0.5, 0.0), (0.5, 1.0))  # left, right, top, bottom
_SMALL = 0.55  # of the width that they could have: smaller, and scrolling is the lesser evil


def show(desk: Desk, document: Document) -> None:
    """The tab."""
    volume, medium, state = document.scene.volume, document.scene.transfer_function, desk.panel_state
    if not volume.labels:
        medium = None
    if state.get("sliced") is not volume:
        state["sliced"], state["slices"] = volume, slices_of(volume)
        state["window"] = typical_window(volume)
        state["crosshair"] = (np.array(volume.dimensions) - 1) / 2
    if medium is None:
        _window(state, volume)
    # A line, a button, and the spaces around what ends the slices.
    spaces = 3 * imgui.get_style().item_spacing.y
    foot = imgui.get_text_line_height_with_spacing() + imgui.get_frame_height_with_spacing() + spaces
    available = imgui.get_content_region_avail()
    _slices(desk, volume, medium, available.x, max(available.y - foot, _LEAST))
    index = state["crosshair"]
    here = volume.origin + volume.world_from_index @ index
    position = ", ".join(f"{part:.5g}" for part in here)
    found = probe.at_point(document.scene, here)
    imgui.text_unformatted(f"{position} {volume.unit}".strip() + f":  {found.value:.5g}")
    if imgui.button("turn about the crosshair"):
        document.look(navigation.with_pivot(document.view, here))
    imgui.set_item_tooltip(
        "In the slices: a double click lets one fill the panel, or brings back all; a drag with the right button\n"
        "changes window and level; the wheel goes through them."
    )


def mark(desk: Desk) -> None:
    """Where the crosshair is in the picture, while the tab is open; in front of whatever is there."""
    document, state = desk.document, desk.panel_state
    if document is None or state.get("tab") != "Slices" or not desk.preferences.panels:
        return
    volume = document.scene.volume
    if state.get("sliced") is not volume:
        return
    here = volume.origin + volume.world_from_index @ state["crosshair"]
    position = handles.position_of(document.view.camera, here)
    if position is None:
        return
    room, arm = desk.room, _ARM * max(float(imgui.get_style().font_scale_dpi), 1.0)
    x = room.x + room.width / 2 + position[0] * room.height / 2
    y = room.y + room.height / 2 - position[1] * room.height / 2
    drawn = imgui.get_background_draw_list()
    drawn.push_clip_rect(imgui.ImVec2(room.x, room.y), imgui.ImVec2(room.x + room.width, room.y + room.height))
    for right, down in ((arm, 0.0), (0.0, arm)):
        for side in (-1, 1):  # open in the middle, where one looks
            start = imgui.ImVec2(x + side * right / 3, y + side * down / 3)
            drawn.add_line(start, imgui.ImVec2(x + side * right, y + side * down), _LINE, 1.5)
    drawn.pop_clip_rect()


def _window(state: dict[str, Any], volume: Volume) -> None:
    low, high = volume.finite_range or (0.0, 1.0)
    centre, width = state["window"]
    moved, centre = parts.slider("level", centre, low, high)
    wider, width = parts.slider("window", width, 1e-3 * (high - low), 2 * (high - low))
    if moved or wider:
        state["window"] = centre, max(width, 1e-300)


def _slices(desk: Desk, volume: Volume, medium: TransferFunction | None, width: float, height: float) -> None:
    """All of them, or the one that was chosen."""
    state = desk.panel_state
    alone = state.get("slice alone")
    names = [alone] if alone else list(NAMES)
    extents = [state["slices"][name].extent(volume) for name in names]
    positions = tiled(extents, width, height, _GAP)
    least = _LEAST_SLICE * max(float(imgui.get_style().font_scale_dpi), 1.0)
    narrow = positions[0].width < _SMALL * width and positions[0].columns == 1
    if not alone and (narrow or min(position.width for position in positions) < least):
        positions = tiled(extents, width, np.inf, _GAP)
    start = imgui.get_cursor_pos()
    bottom = 0.0
    for name, position in zip(names, positions, strict=True):
        imgui.set_cursor_pos(imgui.ImVec2(start.x + position.x, start.y + position.y))
        _slice(desk, name, volume, medium, imgui.ImVec2(position.width, position.height))
        bottom = max(bottom, position.y + position.height)
    imgui.set_cursor_pos(imgui.ImVec2(start.x, start.y + bottom))
    imgui.dummy(imgui.ImVec2(1, 1))  # what is below begins below all of them


def _texture(desk: Desk, name: str, volume: Volume, medium: TransferFunction | None, number: int) -> int:
    """The slice's picture: grey, or by the transfer function of labels."""
    window, slice_ = desk.panel_state["window"], desk.panel_state["slices"][name]

    def make() -> Any:
        values = slice_.values(volume, number)
        return grey(values, window) if medium is None else painted(values, medium)

    return desk.texture(name, (id(volume), number, window if medium is None else medium), make)


def _text(x: float, y: float, text: str) -> None:
    """White, with a dark border for what is bright behind it."""
    draw = imgui.get_window_draw_list()
    for right, down in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        draw.add_text(imgui.ImVec2(x + right, y + down), 0xC0_00_00_00, text)
    draw.add_text(imgui.ImVec2(x, y), 0xFF_FF_FF_FF, text)


def _windowing(state: dict[str, Any], volume: Volume) -> None:
    """A drag with the right button in the last item: across the window's width, upwards its level."""
    io = imgui.get_io()
    if imgui.is_item_hovered() and imgui.is_mouse_clicked(1):
        state["windowing"] = imgui.get_item_id()
    if not io.mouse_down[1]:
        state["windowing"] = None
    elif state.get("windowing") == imgui.get_item_id():
        low, high = volume.finite_range or (0.0, 1.0)
        step = (high - low) / _WINDOWING
        centre, width = state["window"]
        centre = min(max(centre - step * io.mouse_delta.y, low), high)
        state["window"] = centre, max(width + step * io.mouse_delta.x, 1e-3 * (high - low), 1e-300)


def _slice(desk: Desk, name: str, volume: Volume, medium: TransferFunction | None, size: Any) -> None:
    """One slice; a drag in it moves the crosshair, the wheel goes through, a double click shows it alone."""
    state = desk.panel_state
    slice_: Slice = state["slices"][name]
    index = state["crosshair"]
    number = round(float(index[slice_.axis]))
    start = imgui.get_cursor_screen_pos()
    draw = imgui.get_window_draw_list()
    end = imgui.ImVec2(start.x + size.x, start.y + size.y)
    draw.add_image(imgui.ImTextureRef(_texture(desk, name, volume, medium, number)), start, end)
    right, down = slice_.fractions(volume, index)
    x, y = start.x + right * size.x, start.y + down * size.y
    draw.add_line(imgui.ImVec2(x, start.y), imgui.ImVec2(x, end.y), _LINE)
    draw.add_line(imgui.ImVec2(start.x, y), imgui.ImVec2(end.x, y), _LINE)
    _text(start.x + 5, start.y + 3, f"{name} {number}")
    for letter, (across, below) in zip(letters_of(volume, slice_) or (), _SIDES, strict=False):
        extent = imgui.calc_text_size(letter)
        at = [low + 4 + fraction * (room - taken - 8) for low, fraction, room, taken in (
            (start.x, across, size.x, extent.x), (start.y, below, size.y, extent.y),
        )]  # fmt: skip
        _text(at[0], at[1], letter)
    imgui.invisible_button(name, size)
    _windowing(state, volume)
    imgui.set_item_key_owner(imgui.Key.mouse_wheel_y)  # it goes through the slices, and does not scroll the panel
    if not imgui.is_mouse_down(0):
        state["slice clicked"] = False
    if imgui.is_item_hovered() and imgui.is_mouse_double_clicked(0):
        state["slice alone"] = None if state.get("slice alone") else name
        state["slice clicked"] = True  # the crosshair stays until that button is up
    elif imgui.is_item_active() and not state.get("slice clicked"):
        mouse = imgui.get_io().mouse_pos
        state["crosshair"] = slice_.moved(volume, index, (mouse.x - start.x) / size.x, (mouse.y - start.y) / size.y)
    elif imgui.is_item_hovered() and imgui.get_io().mouse_wheel:
        count = volume.dimensions[slice_.axis]
        moved = np.array(index)
        moved[slice_.axis] = np.clip(number + np.sign(imgui.get_io().mouse_wheel), 0, count - 1)
        state["crosshair"] = moved
