"""Mask of a volume in the Scene tab: read from a file, taken away, and the values between which it fades in."""

from __future__ import annotations

import os

import numpy as np
from imgui_bundle import imgui

from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.window import editing, opening
from texvol.window.desk import Desk
from texvol.window.naming import shortened
from texvol.window.panels import parts

_LETTERS = 30  # of a file name on a line


def show(desk: Desk, scene: Scene, volume: Volume, number: int) -> None:
    """Show the mask of a volume of the scene, or a button that reads one."""
    mask = editing.owner_of(scene, number).mask
    if mask is None:
        if imgui.button("mask …"):
            opening.browse_for_mask(desk, volume)
        imgui.set_item_tooltip("show only a segmented part, or multiply the opacity by weights, on the volume's grid")
        return
    imgui.new_line()
    imgui.text_unformatted("mask: " + shortened(os.path.basename(mask.name), _LETTERS))
    imgui.set_item_tooltip(mask.name)
    imgui.same_line()
    removed = imgui.small_button("remove##mask")
    imgui.set_item_tooltip("take the mask away; undo brings it back")
    if removed:
        desk.change(**editing.with_own(scene, number, mask=None))
        return
    _fade(desk, volume, mask)


def _fade(desk: Desk, volume: Volume, mask: Mask) -> None:
    """Show the values of the mask's file at which weights are 0 and 1; a change reads the file again."""
    path, given = mask.source.get("absolute"), mask.source.get("fade")
    if path is None:
        return
    fades = parts.switch("fades in", given is not None)
    imgui.set_item_tooltip("weights rise from 0 at the first value to 1 at the second")
    low, high = given or (0.0, 1.0)
    if fades != (given is not None):
        opening.mask(desk, volume, path, (low, high) if fades else None)
    if given is None:
        return
    imgui.same_line()
    imgui.set_next_item_width(-1)
    flags = imgui.InputTextFlags_.enter_returns_true
    changed, ends = imgui.input_float2("##fade", [float(low), float(high)], "%.5g", flags)
    if changed and np.isfinite(ends).all() and ends[0] != ends[1]:
        opening.mask(desk, volume, path, (float(ends[0]), float(ends[1])))
