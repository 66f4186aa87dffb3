"""Scene tab: volumes with their masks, and meshes; they can be added, changed and removed."""

from __future__ import annotations

import os

import numpy as np
from imgui_bundle import imgui

from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.shapes import Mesh
from texvol.scene.volume import Volume
from texvol.window import commands, contents, editing, opening
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.naming import shortened, volume_called
from texvol.window.panels import parts

_LETTERS = 30  # of a file name on a line
_LEAST_OPACITY = 0.01  # on the slider: a mesh of opacity 0 would be invisible, and is removed by a button instead
_SLIDER = 90.0  # window coordinates at scale 1


def show(desk: Desk, document: Document) -> None:
    """Show the Scene tab."""
    scene = document.scene
    imgui.separator_text("Volumes")
    for number, volume in enumerate(scene.volumes):
        imgui.push_id(number)
        _volume(desk, scene, volume, number)
        imgui.pop_id()
    imgui.separator_text("Meshes")
    for number in range(len(scene.geometry)):
        imgui.push_id(1000 + number)
        _mesh(desk, scene, number)
        imgui.pop_id()
    if not scene.geometry:
        imgui.text_disabled("none")
    imgui.separator()
    if imgui.button("add a volume or a mesh …", imgui.ImVec2(-1, 0)):
        commands.run(desk, "add")
    imgui.set_item_tooltip("or drop a file on the window")
    if scene.mode != "composite":
        parts.note(f"Only mode composite draws several volumes; the mode is {scene.mode}.")


def _volume(desk: Desk, scene: Scene, volume: Volume, number: int) -> None:
    several = len(scene.volumes) > 1
    imgui.text_unformatted(f"{number + 1}: " * several + volume_called(volume, _LETTERS))
    imgui.set_item_tooltip(str(volume.source.get("absolute", volume.name)))
    size = " x ".join(map(str, volume.dimensions))
    imgui.text_disabled(f"{size} {volume.dtype}" + (f", {volume.unit}" if volume.unit else ""))
    _mask(desk, scene, volume, number)
    if several and imgui.button("transfer function"):
        desk.panel_state["volume"] = number
        commands.run(desk, "tab Medium")
    if several:
        imgui.set_item_tooltip("edit the transfer function of this volume")
    if number:
        imgui.same_line()
        if imgui.button("remove"):
            desk.change(added=scene.added[: number - 1] + scene.added[number:])
        imgui.set_item_tooltip("take this volume out of the scene; undo brings it back")
    imgui.spacing()


def _mask(desk: Desk, scene: Scene, volume: Volume, number: int) -> None:
    mask = editing.owner_of(scene, number).mask
    if mask is None:
        if imgui.button("mask …"):
            opening.browse_for_mask(desk, volume)
        imgui.set_item_tooltip("show only a segmented part, or multiply the opacity by weights, on the volume's grid")
        if len(scene.volumes) > 1:
            imgui.same_line()
        return
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


def _mesh(desk: Desk, scene: Scene, number: int) -> None:
    """Show the row of a mesh: colour, name, opacity, and a button to remove it."""
    shape = scene.geometry[number]
    color = parts.color("##color", shape.color, small=True)
    imgui.same_line()
    imgui.text_unformatted(shortened(os.path.basename(shape.name), _LETTERS))
    size = f"{len(shape.triangles):,} triangles" if isinstance(shape, Mesh) else "lines"
    imgui.set_item_tooltip(f"{shape.name}\n{size}")
    imgui.set_next_item_width(_SLIDER * parts.scale())
    opacity = parts.slider("opacity", shape.opacity, _LEAST_OPACITY, 1.0, "%.2f")
    imgui.same_line()
    removed = imgui.button("remove")
    imgui.set_item_tooltip("take the mesh out of the scene; undo brings it back")
    if removed:
        desk.change(geometry=scene.geometry[:number] + scene.geometry[number + 1 :])
    elif (color, opacity) != (shape.color, shape.opacity):
        desk.change(f"mesh {number}", **contents.with_look(scene, number, color, opacity))
