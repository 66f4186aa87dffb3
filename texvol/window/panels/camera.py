"""View tab: camera, background, annotation and quality."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from imgui_bundle import imgui

from texvol.annotation.request import PARTS, Annotation
from texvol.scene.scene import Scene
from texvol.scene.spaces import letters_of_space
from texvol.window import commands, navigation
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.panels import parts


def show(desk: Desk, document: Document) -> None:
    """Show the View tab."""
    imgui.separator_text("Camera")
    view, box = document.view, document.scene.box
    kind = parts.choice("projection", view.camera.projection, ("orthographic", "perspective"))
    if kind != view.camera.projection:
        commands.run(desk, "projection")
    elif kind == "perspective":
        changed, fov = parts.slider("field of view", view.camera.fov, 5, 120, "%.0f°")
        if changed:
            document.look(navigation.with_fov(view, fov))
    else:
        changed, height = parts.number("height", view.camera.height)
        if changed and height > 0:
            document.look(replace(view, camera=replace(view.camera, height=height)))
    turning = parts.choice("turning", "freely" if desk.steering.free else "turntable", ("turntable", "freely"))
    desk.steering.free = turning == "freely"
    pressed = parts.buttons(list(navigation.AXES), 6)
    if pressed:
        commands.run(desk, f"axis {pressed}")
    pressed = parts.buttons(["reset", "frame"], 2)
    if pressed:
        commands.run(desk, pressed)
    eye = ", ".join(f"{each:.4g}" for each in view.camera.eye)
    imgui.text_disabled(f"eye {eye} {box.unit}")
    _picture(desk)


def _annotate(desk: Desk, annotation: Annotation) -> None:
    """Change the annotation, if it can be drawn."""
    document = desk.document
    assert document is not None

    desk.attempt(lambda: document.annotate(annotation, desk.pixels))


def _part(part: str, was_on: bool, scene: Scene) -> tuple[bool, bool]:
    """Show the switch of a part of the annotation; it is disabled if the volume lacks the information for it."""
    lacks = part == "orientation" and not was_on and letters_of_space(scene.volume.space) is None
    imgui.begin_disabled(lacks)
    changed, on = parts.switch(part.replace("-", " "), was_on)
    imgui.end_disabled()
    if lacks and imgui.is_item_hovered(imgui.HoveredFlags_.allow_when_disabled.value):
        imgui.set_tooltip("The volume does not say in which directions of the body its axes point.")
    return changed, on


def _picture(desk: Desk) -> None:
    document = desk.document
    assert document is not None
    scene, showing = document.scene, document.showing
    imgui.separator_text("Picture")
    changed, color = parts.color("background", scene.background)
    if changed:
        desk.change("background", background=color)
    annotation = showing.annotation
    for position, part in enumerate(PARTS):
        if position % 2:
            imgui.same_line(imgui.get_content_region_avail().x / 2)
        name = part.replace("-", "_")
        changed, on = _part(part, getattr(annotation, name), scene)
        if changed:
            further: dict[str, Any] = {name: on}
            _annotate(desk, replace(annotation, **further))
    changed, title = imgui.input_text("title", annotation.title or "")
    if changed:
        document.show(annotation=replace(document.showing.annotation, title=title or None))
    cue = scene.depth_cue
    changed, strength = parts.slider("depth cue", cue.strength if cue else 0.0, 0, 1, "%.2f")
    if changed:
        from texvol.scene.lighting import DepthCue

        cue = replace(cue, strength=strength) if cue else DepthCue(strength)
        desk.change("depth cue", depth_cue=cue if strength > 0 else None)
    imgui.separator_text("Quality")
    changed, rate = parts.slider("frames per second", 1 / desk.director.pace.wanted, 5, 60, "%.0f")
    if changed:
        desk.director.pace.wanted = 1 / rate
    steps = desk.director.max_error * 255
    changed, steps = parts.slider("error at rest (/255)", steps, 0.1, 10, "%.2g")
    if changed and steps > 0:
        desk.director.max_error = steps / 255
        desk.director.again()
