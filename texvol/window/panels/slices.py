"""Slices tab: layout, window and level, further volumes; and the slices themselves while the 3D view is alone.

The slices are arranged so that they are as large as possible. In a low window each is as wide as the panel, and the
panel scrolls. A double click makes one slice fill the panel.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.window import handles, navigation, probe
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.layout import PICTURE
from texvol.window.panels import parts, readout, tiles
from texvol.window.slices import NAMES, tiled
from texvol.window.steering import Viewport

_LINE = 0xB0_50_D0_FF  # a thin amber, ABGR
_LEAST = 60.0  # window coordinates
_LEAST_SLICE = 80.0  # window coordinates: leaves room for a slice's title
_GAP = 6.0
_ARM = 14.0  # length of the crosshair's arms in the picture
_SMALL = 0.55  # fraction of the panel's width: the panel scrolls if slices would be narrower
_ALONE, _FOUR, _WHOLE, _TURN = "3D alone", "2 x 2", "whole slices", "turn about it"


def show(desk: Desk, document: Document) -> None:
    """Show the Slices tab."""
    scene, layout = document.scene, desk.layout
    layout.follow(scene)
    if not scene.volume.labels:
        low, high = scene.volume.finite_range or (0.0, 1.0)
        layout.window = parts.window(("level", "window"), layout.window, low, high)
    if scene.added:
        layout.opacity = parts.slider("further volumes", layout.opacity, 0.0, 1.0, "%.2f")
    if layout.shown:
        found = parts.switches({"outlines in 3D": layout.planes, "slices in 3D": layout.pictures})
        layout.planes, layout.pictures = found["outlines in 3D"], found["slices in 3D"]
        imgui.separator_text("At the crosshair")
    lines = readout.lines(scene, probe.at_point(scene, layout.crosshair), index=layout.shown)
    if not layout.shown:
        lines = [" ".join(lines)] if len(lines) == 2 else lines  # leaves room for the slices
        # Height of the lines of text, the buttons, and the spacing around them.
        spaces = 3 * imgui.get_style().item_spacing.y
        foot = len(lines) * imgui.get_text_line_height_with_spacing() + imgui.get_frame_height_with_spacing() + spaces
        available = imgui.get_content_region_avail()
        _slices(desk, document, available.x, max(available.y - foot, _LEAST))
    for line in lines:
        imgui.text_unformatted(line)
    pressed = parts.buttons((_ALONE if layout.shown else _FOUR, _WHOLE, _TURN), 3)
    if pressed == _TURN:
        document.look(navigation.with_pivot(document.view, layout.crosshair))
    elif pressed == _WHOLE:
        layout.reset()
    elif pressed:
        layout.become(PICTURE if layout.shown else "2x2")


def mark(desk: Desk) -> None:
    """Draw the crosshair in the picture while the Slices tab is open, in front of everything."""
    document, layout = desk.document, desk.layout
    if document is None or desk.panel_state.get("tab") != "Slices" or not desk.preferences.panels:
        return
    if layout.volume is not document.scene.volume:
        return
    position = handles.position_of(document.view.camera, layout.crosshair)
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


def _slices(desk: Desk, document: Document, width: float, height: float) -> None:
    """Show all slices, or only the enlarged one."""
    state, volume = desk.panel_state, document.scene.volume
    alone = state.get("slice alone")
    names = [alone] if alone else list(NAMES)
    extents = [desk.layout.slices[name].extent(volume) for name in names]
    tiles_ = tiled(extents, width, height, _GAP)
    least = _LEAST_SLICE * parts.scale()
    narrow = tiles_[0].width < _SMALL * width and tiles_[0].columns == 1
    if not alone and (narrow or min(tile.width for tile in tiles_) < least):
        tiles_ = tiled(extents, width, np.inf, _GAP)
    start = imgui.get_cursor_pos()
    corner: Any = imgui.get_cursor_screen_pos()
    bottom = 0.0
    for name, tile in zip(names, tiles_, strict=True):
        rectangle = Viewport(corner.x + tile.x, corner.y + tile.y, tile.width, tile.height)
        if tiles.slice_in(desk, document, name, rectangle):
            state["slice alone"] = None if alone else name
        bottom = max(bottom, tile.y + tile.height)
    imgui.set_cursor_pos(imgui.ImVec2(start.x, start.y + bottom))
    imgui.dummy(imgui.ImVec2(1, 1))  # the next control begins below all slices
