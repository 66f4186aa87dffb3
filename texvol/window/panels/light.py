"""Light tab: lights and the reflection of the medium."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.scene.lighting import LIGHT_KINDS, Light, Lighting
from texvol.scene.scene import Scene
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.panels import parts


def show(desk: Desk, document: Document) -> None:
    """Show the Light tab."""
    scene = document.scene
    changed, on = parts.switch("light", scene.lighting is not None)
    if changed:
        desk.change(lighting=Lighting() if on else None)
        return
    if scene.lighting is None:
        surface = scene.mode == "isosurface"
        surface_text = "One light at the eye is used until you switch lights on."
        imgui.text_disabled(surface_text if surface else "Without light, the medium shows its own colours.")
        return
    _reflection(desk, scene.lighting, scene)
    imgui.separator_text("Lights")
    _lights(desk, scene.lighting, scene)


def _reflection(desk: Desk, lighting: Lighting, scene: Scene) -> None:
    for name, most in (("ambient", 1.0), ("diffuse", 1.5), ("specular", 1.5), ("shininess", 128.0)):
        changed, value = parts.slider(name, getattr(lighting, name), 0.0, most, "%.2f")
        if changed:
            desk.change(name, lighting=_with(lighting, name, value))
    changed, on = parts.switch("two-sided", lighting.two_sided)
    if changed:
        desk.change(lighting=replace(lighting, two_sided=on))
    if scene.mode == "composite" and not scene.added:
        imgui.same_line()
        changed, on = parts.switch("shadows", lighting.shadows)
        if changed:
            desk.change(lighting=replace(lighting, shadows=on))


def _with(lighting: Lighting, name: str, value: Any) -> Lighting:
    return replace(lighting, **{name: value})


def _lights(desk: Desk, lighting: Lighting, scene: Scene) -> None:
    lights = lighting.lights
    for position, light in enumerate(lights):
        imgui.push_id(position)
        edited = _light(light, scene)
        imgui.same_line()
        taken = imgui.small_button("remove")
        imgui.pop_id()
        if taken:
            desk.change(lighting=replace(lighting, lights=lights[:position] + lights[position + 1 :]))
            return
        if edited is not light:
            others = (*lights[:position], edited, *lights[position + 1 :])
            desk.change(f"light {position}", lighting=replace(lighting, lights=others))
            return
    if len(lights) < 8 and imgui.button("add a light"):
        desk.change(lighting=replace(lighting, lights=(*lights, Light("directional", (-1.0, -1.0, 1.0)))))


def _light(light: Light, scene: Scene) -> Light:
    kind = parts.choice("kind", light.kind, tuple(LIGHT_KINDS))
    if kind != light.kind:
        x, y, z = map(float, scene.box.centre + [0, 0, 2 * scene.box.radius])
        return Light(kind, {"head": None, "directional": (0.0, 0.0, 1.0), "point": (x, y, z)}[kind], light.color)  # type: ignore[arg-type]
    if light.vector is not None:
        most = 1.0 if kind == "directional" else float(np.abs(light.vector).max() + scene.box.radius)
        speed = most / 200
        label = "from" if kind == "directional" else "at"
        changed, vector = imgui.drag_float3(label, [float(each) for each in light.vector], speed, 0, 0, "%.3g")
        if changed and any(vector):
            x, y, z = (float(each) for each in vector)
            return replace(light, vector=(x, y, z))
    brightest = max(*light.color, 1.0)
    changed, color = parts.color("colour", [each / brightest for each in light.color])
    if changed:
        red, green, blue = (each * brightest for each in color)
        return replace(light, color=(red, green, blue))
    return light
