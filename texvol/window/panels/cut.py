"""Cut tab: crop box, clip planes and caps."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui

from texvol.scene.cutting import ClipPlane
from texvol.scene.volume import Volume
from texvol.window import switched
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.handles import bounds
from texvol.window.navigation import triple
from texvol.window.panels import parts

_ROUNDING = 1e-12  # relative, of a few operations


def show(desk: Desk, document: Document) -> None:
    """Show the Cut tab."""
    scene = document.scene
    _crop(desk, document)
    _planes(desk, document)
    if scene.mode == "composite" and (scene.crop or scene.clip):
        imgui.separator()
        desk.change(caps=parts.switch("caps: opaque cut surfaces", scene.caps))
    if scene.crop or scene.clip:
        turns = " Drag the tip of a plane's arrow to turn the plane." if scene.clip else ""
        hint = "Drag the handles in the picture. A handle that points at you moves away when you drag upwards."
        parts.note(hint + turns)


def _crop(desk: Desk, document: Document) -> None:
    imgui.separator_text("Crop box")
    scene = document.scene
    limits = bounds(scene.box)
    on = parts.switch("crop box", scene.crop is not None)
    if on != (scene.crop is not None):
        desk.change(**switched.crop_switched(scene, document.off, limits))
    elif scene.crop is not None:
        ranges = list(scene.crop)
        for axis, name in enumerate("xyz"):
            low, high = limits[axis]
            shown = max(ranges[axis][0], low), min(ranges[axis][1], high)
            if (wanted := parts.ends(f"{name}##crop", shown, low, high)) != shown:
                ranges[axis] = wanted
        desk.change("crop", crop=tuple(ranges))


def _planes(desk: Desk, document: Document) -> None:
    imgui.separator_text("Clip planes")
    scene = document.scene
    planes: list[tuple[ClipPlane, bool]] = []
    for position, (plane, was_on) in enumerate(switched.all_planes(scene, document.off)):
        imgui.push_id(position)
        on = parts.switch(f"plane {position + 1}", was_on)
        imgui.set_item_tooltip("a plane that is switched off cuts nothing and stays in this list")
        imgui.same_line()
        taken = imgui.small_button("remove")
        imgui.set_item_tooltip("take the plane out of the list")
        imgui.same_line()
        turns = imgui.small_button("other side")
        imgui.set_item_tooltip("cut away what is on the other side of the plane")
        edited = ClipPlane(triple(np.negative(plane.normal)), -plane.offset) if turns else plane
        if was_on and not turns:
            edited = _plane(plane, scene.box)
        imgui.pop_id()
        if not taken:
            planes.append((edited, on))
    imgui.text_unformatted("add a plane perpendicular to")
    pressed = parts.buttons(("view", "x", "y", "z"), 4)
    if pressed:
        directions = dict(zip("xyz", np.eye(3), strict=True)) | {"view": document.view.camera.forward}
        normal = directions[pressed]
        planes.append((ClipPlane(triple(normal), float(normal @ scene.box.centre)), True))
    desk.change("clip", **switched.planes_changed(planes, document.off))


def _plane(plane: ClipPlane, box: Volume) -> ClipPlane:
    size = float(np.linalg.norm(plane.normal))
    unit = np.array(plane.normal) / size
    middle = float(unit @ box.centre)
    from_middle = plane.offset / size - middle
    if abs(from_middle) < _ROUNDING * (abs(middle) + box.radius):
        from_middle = 0.0  # not 3e-14, after the plane was turned
    changed, numbers = imgui.drag_float3("normal", list(plane.normal), 0.01, -1, 1, "%.3f")
    imgui.set_item_tooltip("direction in which the plane cuts everything away")
    length = float(np.linalg.norm(numbers))
    if changed and length > 1e-3:
        # The plane turns about its point nearest to the centre of the box.
        normal = np.array(numbers) / length
        return ClipPlane(triple(normal), float(normal @ (box.centre + from_middle * unit)))
    position = parts.slider("position", from_middle, -box.radius, box.radius)
    return plane if position == from_middle else ClipPlane(plane.normal, (position + middle) * size)
