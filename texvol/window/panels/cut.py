"""Cut tab: crop box, clip planes and caps."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui

from texvol.scene.cutting import ClipPlane
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.handles import bounds
from texvol.window.navigation import triple
from texvol.window.panels import parts


def show(desk: Desk, document: Document) -> None:
    """Show the Cut tab."""
    scene = document.scene
    _crop(desk, scene)
    _planes(desk, document)
    if scene.mode == "composite" and (scene.crop or scene.clip):
        imgui.separator()
        desk.change(caps=parts.switch("caps: opaque cut surfaces", scene.caps))
    if scene.crop or scene.clip:
        turns = " Drag the tip of a plane's arrow to turn the plane." if scene.clip else ""
        hint = "Drag the handles in the picture. A handle that points at you moves away when you drag upwards."
        parts.note(hint + turns)


def _crop(desk: Desk, scene: Scene) -> None:
    imgui.separator_text("Crop box")
    limits = bounds(scene.box)
    on = parts.switch("crop box", scene.crop is not None)
    if on != (scene.crop is not None):
        desk.change(crop=limits if on else None)
    elif scene.crop is not None:
        ranges = list(scene.crop)
        for axis, name in enumerate("xyz"):
            low, high = limits[axis]
            shown = max(ranges[axis][0], low), min(ranges[axis][1], high)
            if (wanted := parts.ends(name, shown, low, high)) != shown:
                ranges[axis] = wanted
        desk.change("crop", crop=tuple(ranges))


def _planes(desk: Desk, document: Document) -> None:
    imgui.separator_text("Clip planes")
    scene, planes = document.scene, []
    for position, plane in enumerate(scene.clip):
        imgui.push_id(position)
        edited = _plane(plane, scene.box)
        taken = imgui.small_button("remove")
        imgui.same_line()
        if imgui.small_button("other side"):
            edited = ClipPlane(triple(np.negative(plane.normal)), -plane.offset)
        imgui.pop_id()
        if not taken:
            planes.append(edited)
    imgui.text_unformatted("add a plane perpendicular to")
    pressed = parts.buttons(("view", "x", "y", "z"), 4)
    if pressed:
        directions = dict(zip("xyz", np.eye(3), strict=True)) | {"view": document.view.camera.forward}
        normal = directions[pressed]
        planes.append(ClipPlane(triple(normal), float(normal @ scene.box.centre)))
    desk.change("clip", clip=tuple(planes))


def _plane(plane: ClipPlane, box: Volume) -> ClipPlane:
    size = float(np.linalg.norm(plane.normal))
    unit = np.array(plane.normal) / size
    middle = float(unit @ box.centre)
    from_middle = plane.offset / size - middle
    changed, numbers = imgui.drag_float3("normal", list(plane.normal), 0.01, -1, 1, "%.3f")
    length = float(np.linalg.norm(numbers))
    if changed and length > 1e-3:
        # The plane turns about its point nearest to the centre of the box.
        normal = np.array(numbers) / length
        return ClipPlane(triple(normal), float(normal @ (box.centre + from_middle * unit)))
    position = parts.slider("position", from_middle, -box.radius, box.radius)
    return plane if position == from_middle else ClipPlane(plane.normal, (position + middle) * size)
