"""View tab: camera, background, annotation and quality."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from imgui_bundle import imgui

from texvol.annotation.request import PARTS
from texvol.scene.framing import VIEWS
from texvol.scene.lighting import DepthCue
from texvol.scene.scene import Scene
from texvol.scene.spaces import letters_of_space
from texvol.slicing.slabs import SLICINGS
from texvol.window import commands, navigation, sides
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.panels import parts, saved_views, tips


def show(desk: Desk, document: Document) -> None:
    """Show the View tab."""
    imgui.separator_text("Camera")
    view, box = document.view, document.scene.box
    kind = parts.choice("projection", view.camera.projection, ("orthographic", "perspective"))
    if kind != view.camera.projection:
        commands.run(desk, "projection")
    elif kind == "perspective":
        fov = parts.slider("field of view", view.camera.fov, 5, 120, "%.0f°")
        if fov != view.camera.fov:
            document.look(navigation.with_fov(view, fov))
    else:
        height = parts.number("height", view.camera.height)
        if height > 0 and height != view.camera.height:
            document.look(replace(view, camera=replace(view.camera, height=height)))
    turning = parts.choice("turning", "freely" if desk.steering.free else "turntable", ("turntable", "freely"))
    desk.steering.free = turning == "freely"
    _sides(desk, document)
    pressed = parts.buttons(["reset", "frame"], 2)
    if pressed:
        commands.run(desk, pressed)
    desk.moving.cube = parts.switch("orientation cube", desk.moving.cube)
    eye = ", ".join(f"{each:.4g}" for each in view.camera.eye)
    imgui.text_disabled(f"eye {eye} {box.unit}")
    saved_views.show(desk, document)
    _picture(desk, document)
    imgui.separator_text("Quality")
    director = desk.director
    rate = 1 / director.pace.wanted
    if (wanted := parts.slider("frames per second", rate, 5, 60, "%.0f")) != rate:
        director.pace.wanted = 1 / wanted
    steps = director.max_error * 255
    if (wanted := parts.slider("error at rest (/255)", steps, 0.1, 10, "%.2g")) != steps:
        director.max_error = wanted / 255
        director.again()
    if (slicing := parts.choice("slicing at rest", director.slicing, SLICINGS)) != director.slicing:
        director.slicing = slicing
        director.again()


def _sides(desk: Desk, document: Document) -> None:
    """Show the buttons of the sides that a scene is seen from, and of the axes."""
    names = sides.names(document.scene.volume)
    for row in (VIEWS[:4], VIEWS[4:]):
        pressed = parts.buttons([names[side] for side in row], len(row))
        for side in row:
            if pressed == names[side]:
                commands.run(desk, f"view {side}")
    pressed = parts.buttons(list(navigation.AXES), 6)
    if pressed:
        commands.run(desk, f"axis {pressed}")


def _part(part: str, was_on: bool, scene: Scene) -> bool:
    """Show the switch of a part of the annotation; it is disabled if the volume lacks the information for it."""
    lacks = part == "orientation" and not was_on and letters_of_space(scene.volume.space) is None
    imgui.begin_disabled(lacks)
    on = parts.switch(part.replace("-", " "), was_on)
    imgui.end_disabled()
    if lacks and imgui.is_item_hovered(imgui.HoveredFlags_.allow_when_disabled.value):
        imgui.set_tooltip("The volume does not say in which directions of the body its axes point.")
    return on


def _picture(desk: Desk, document: Document) -> None:
    scene, annotation = document.scene, document.showing.annotation
    imgui.separator_text("Picture")
    desk.change("background", background=parts.color("background", scene.background))
    wanted: dict[str, Any] = {}
    for position, part in enumerate(PARTS):
        if position % 2:
            imgui.same_line(imgui.get_content_region_avail().x / 2)
        name = part.replace("-", "_")
        wanted[name] = _part(part, getattr(annotation, name), scene)
    if (changed := replace(annotation, **wanted)) != annotation:
        desk.attempt(lambda: document.annotate(changed, desk.pixels))
    entered, title = imgui.input_text("title", annotation.title or "")
    tips.show("title")
    if entered:
        document.show(annotation=replace(document.showing.annotation, title=title or None))
    before = scene.depth_cue or DepthCue(0.0)
    cue = replace(before, strength=parts.slider("depth cue", before.strength, 0, 1, "%.2f"))
    if cue != before:
        desk.change("depth cue", depth_cue=cue if cue.strength > 0 else None)
