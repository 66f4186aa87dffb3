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
from texvol.window.panels import parts


def show(desk: Desk, document: Document) -> None:
    """Show the Cut tab."""
    scene = document.scene
    _crop(desk, scene)
    _planes(desk, scene)
    if scene.mode == "composite" and (scene.crop or scene.clip):
        imgui.separator()
        changed, on = parts.switch("caps: opaque cut surfaces", scene.caps)
        if changed:
            desk.change(caps=on)
    if scene.crop or scene.clip:
        imgui.push_text_wrap_pos(0.0)
        turns = " Drag the tip of a plane's arrow to turn the plane." if scene.clip else ""
        hint = "Drag the handles in the picture. A handle that points at you moves away when you drag upwards."
        imgui.text_disabled(hint + turns)
        imgui.pop_text_wrap_pos()


def _crop(desk: Desk, scene: Scene) -> None:
    imgui.separator_text("Crop box")
    limits = bounds(scene.box)
    changed, on = parts.switch("crop box", scene.crop is not None)
    if changed:
        desk.change(crop=limits if on else None)
        return
    if scene.crop is None:
        return
    for axis, name in enumerate("xyz"):
        ends = scene.crop[axis]
        low, high = limits[axis]
        changed, wanted = parts.ends(name, (max(ends[0], low), min(ends[1], high)), low, high)
        if changed and wanted[0] < wanted[1]:
            ranges = list(scene.crop)
            ranges[axis] = wanted
            desk.change("crop", crop=tuple(ranges))


def _planes(desk: Desk, scene: Scene) -> None:
    imgui.separator_text("Clip planes")
    for position, plane in enumerate(scene.clip):
        imgui.push_id(position)
        edited = _plane(plane, scene.box)
        taken = imgui.small_button("remove")
        imgui.same_line()
        turned = imgui.small_button("other side")
        imgui.pop_id()
        planes = list(scene.clip)
        if taken:
            del planes[position]
        elif turned:
            x, y, z = (-each for each in plane.normal)
            planes[position] = ClipPlane((x, y, z), -plane.offset)
        else:
            planes[position] = edited
        if taken or edited is not plane or turned:
            desk.change(None if taken or turned else f"plane {position}", clip=tuple(planes))
            return
    imgui.text_unformatted("add a plane perpendicular to")
    pressed = parts.buttons(("view", "x", "y", "z"), 4)
    if pressed:
        document = desk.document
        assert document is not None
        directions = dict(zip("xyz", np.eye(3), strict=True)) | {"view": document.view.camera.forward}
        x, y, z = (float(each) for each in directions[pressed])
        desk.change(clip=(*scene.clip, ClipPlane((x, y, z), float(directions[pressed] @ scene.box.centre))))


def _plane(plane: ClipPlane, box: Volume) -> ClipPlane:
    changed, normal = imgui.drag_float3("normal", [float(each) for each in plane.normal], 0.01, -1, 1, "%.3f")
    numbers = np.array(list(normal), np.float64)
    length = float(np.linalg.norm(numbers))
    if changed and length > 1e-3:
        # The plane turns about its point nearest to the centre of the box.
        old = np.array(plane.normal) / np.linalg.norm(plane.normal)
        at = box.centre + (plane.offset / np.linalg.norm(plane.normal) - old @ box.centre) * old
        x, y, z = (float(each) for each in numbers / length)
        return ClipPlane((x, y, z), float(numbers / length @ at))
    size = float(np.linalg.norm(plane.normal))
    unit = np.array(plane.normal) / size
    middle = float(unit @ box.centre)
    changed, position = parts.slider("position", plane.offset / size - middle, -box.radius, box.radius)
    return ClipPlane(plane.normal, (position + middle) * size) if changed else plane
