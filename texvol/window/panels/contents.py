"""Scene tab: volumes with their masks, and meshes; they can be added, changed and removed."""

from __future__ import annotations

import os

from imgui_bundle import imgui

from texvol.scene.scene import Scene
from texvol.scene.shapes import Mesh
from texvol.window import commands, contents
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.naming import shortened
from texvol.window.panels import parts, volumes

_LETTERS = 30  # of a file name on a line
_LEAST_OPACITY = 0.01  # on the slider: a mesh of opacity 0 would be invisible, and is removed by a button instead
_SLIDER = 90.0  # window coordinates at scale 1


def show(desk: Desk, document: Document) -> None:
    """Show the Scene tab."""
    scene = document.scene
    imgui.separator_text("Volumes")
    volumes.show(desk, document)
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
