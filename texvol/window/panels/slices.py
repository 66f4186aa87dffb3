"""Slices tab: axial, coronal and sagittal slices with a crosshair, window and level.

The slices are arranged so that they are as large as possible. In a low window each is as wide as the panel, and the
panel scrolls. A double click makes one slice fill the panel.
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
from texvol.window.measure_slices import SliceMap
from texvol.window.panels import measure_in_slices, parts
from texvol.window.slices import NAMES, Slice, grey, letters_of, painted, slices_of, tiled, typical_window

_LINE = 0xB0_50_D0_FF  # a thin amber, ABGR
_LEAST = 60.0  # window coordinates
_LEAST_SLICE = 80.0  # window coordinates: leaves room for a slice's title
_GAP = 6.0
_ARM = 14.0  # length of the crosshair's arms in the picture
_WINDOWING = 300.0  # window coordinates: a drag of this length changes the window by all values
_SIDES = ((0.0, 0.5), (1.0, 0.5), (0.5, 0.0), (0.5, 1.0))  # left, right, top, bottom
_SMALL = 0.55  # fraction of the panel's width: the panel scrolls if slices would be narrower


def show(desk: Desk, document: Document) -> None:
    """Show the Slices tab."""
    volume, state = document.scene.volume, desk.panel_state
    medium = document.scene.transfer_function if volume.labels else None
    if state.get("sliced") is not volume:
        state["sliced"], state["slices"] = volume, slices_of(volume)
        state["window"] = typical_window(volume)
        state["crosshair"] = (np.array(volume.dimensions) - 1) / 2
    if medium is None:
        low, high = volume.finite_range or (0.0, 1.0)
        state["window"] = parts.window(("level", "window"), state["window"], low, high)
    # Height of the line of text, the button, and the spacing around them.
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
        "In a slice: double click to enlarge it or to show all; drag with the right button to change\n"
        "window and level; turn the wheel to go through the slices."
    )


def mark(desk: Desk) -> None:
    """Draw the crosshair in the picture while the Slices tab is open, in front of everything."""
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
    arm = _ARM * parts.scale()
    x, y = desk.viewport.point(position)
    drawn = imgui.get_background_draw_list()
    drawn.push_clip_rect(*parts.corners(desk.viewport))
    for right, down in ((arm, 0.0), (0.0, arm)):
        for side in (-1, 1):  # the centre is left free
            start = imgui.ImVec2(x + side * right / 3, y + side * down / 3)
            drawn.add_line(start, imgui.ImVec2(x + side * right, y + side * down), _LINE, 1.5)
    drawn.pop_clip_rect()


def _slices(desk: Desk, volume: Volume, medium: TransferFunction | None, width: float, height: float) -> None:
    """Show all slices, or only the enlarged one."""
    state = desk.panel_state
    alone = state.get("slice alone")
    names = [alone] if alone else list(NAMES)
    extents = [state["slices"][name].extent(volume) for name in names]
    tiles = tiled(extents, width, height, _GAP)
    least = _LEAST_SLICE * parts.scale()
    narrow = tiles[0].width < _SMALL * width and tiles[0].columns == 1
    if not alone and (narrow or min(tile.width for tile in tiles) < least):
        tiles = tiled(extents, width, np.inf, _GAP)
    start = imgui.get_cursor_pos()
    bottom = 0.0
    for name, tile in zip(names, tiles, strict=True):
        imgui.set_cursor_pos(imgui.ImVec2(start.x + tile.x, start.y + tile.y))
        _slice(desk, name, volume, medium, imgui.ImVec2(tile.width, tile.height))
        bottom = max(bottom, tile.y + tile.height)
    imgui.set_cursor_pos(imgui.ImVec2(start.x, start.y + bottom))
    imgui.dummy(imgui.ImVec2(1, 1))  # the next control begins below all slices


def _texture(desk: Desk, name: str, volume: Volume, medium: TransferFunction | None, number: int) -> int:
    """Return the texture of a slice: grey, or labels in colour."""
    window, slice_ = desk.panel_state["window"], desk.panel_state["slices"][name]

    def make() -> Any:
        values = slice_.values(volume, number)
        return grey(values, window) if medium is None else painted(values, medium)

    assert desk.textures is not None
    return desk.textures.get(name, (id(volume), number, window if medium is None else medium), make)


def _text(x: float, y: float, text: str) -> None:
    """Draw white text with a dark border, legible on any background."""
    draw = imgui.get_window_draw_list()
    for right, down in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        draw.add_text(imgui.ImVec2(x + right, y + down), 0xC0_00_00_00, text)
    draw.add_text(imgui.ImVec2(x, y), 0xFF_FF_FF_FF, text)


def _windowing(state: dict[str, Any], volume: Volume) -> None:
    """Process a drag with the right button in the last item: sideways changes the window, upwards the level."""
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


def _measures(desk: Desk, name: str, seen: SliceMap) -> bool:
    """Show the measures over the last item, a slice; return True if the mouse is used for them."""
    assert desk.document is not None
    draw = imgui.get_window_draw_list()
    draw.push_clip_rect(imgui.get_item_rect_min(), imgui.get_item_rect_max(), True)
    used = measure_in_slices.show(desk, desk.document, seen, name, hovered=imgui.is_item_hovered())
    draw.pop_clip_rect()
    return used


def _slice(desk: Desk, name: str, volume: Volume, medium: TransferFunction | None, size: Any) -> None:
    """Show a slice: a drag moves the crosshair, the wheel changes the slice, a double click enlarges it."""
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
        x, y = start.x + 4 + across * (size.x - extent.x - 8), start.y + 4 + below * (size.y - extent.y - 8)
        _text(x, y, letter)
    imgui.invisible_button(name, size)
    _windowing(state, volume)
    measures = _measures(desk, name, SliceMap.of(volume, slice_, number, (start.x, start.y), (size.x, size.y)))
    imgui.set_item_key_owner(imgui.Key.mouse_wheel_y)  # the wheel changes the slice and does not scroll the panel
    if not imgui.is_mouse_down(0):
        state["slice clicked"] = False
    if measures:
        return
    if imgui.is_item_hovered() and imgui.is_mouse_double_clicked(0):
        state["slice alone"] = None if state.get("slice alone") else name
        state["slice clicked"] = True  # the crosshair stays until the button is released
    elif imgui.is_item_active() and not state.get("slice clicked"):
        mouse = imgui.get_io().mouse_pos
        state["crosshair"] = slice_.moved(volume, index, (mouse.x - start.x) / size.x, (mouse.y - start.y) / size.y)
    elif imgui.is_item_hovered() and imgui.get_io().mouse_wheel:
        count = volume.dimensions[slice_.axis]
        moved = np.array(index)
        moved[slice_.axis] = np.clip(number + np.sign(imgui.get_io().mouse_wheel), 0, count - 1)
        state["crosshair"] = moved
