"""Light tab: lights and the reflection of the medium."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.scene.lighting import LIGHT_KINDS, Light, Lighting
from texvol.scene.scene import Scene
from texvol.window import switched
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.navigation import triple
from texvol.window.panels import parts

_MOST_LIGHTS = 8


def show(desk: Desk, document: Document) -> None:
    """Show the Light tab."""
    scene = document.scene
    lighting = scene.lighting
    on = parts.switch("light", lighting is not None)
    if on != (lighting is not None):
        desk.change(**switched.light_switched(scene, document.off))
    elif lighting is not None:
        wanted = _reflection(lighting, scene)
        imgui.separator_text("Lights")
        wanted["lights"] = _lights(lighting.lights, scene)
        desk.attempt(lambda: desk.change("lighting", lighting=replace(lighting, **wanted)))
    elif scene.mode == "isosurface":
        imgui.text_disabled("One light at the eye is used until you switch lights on.")
    else:
        imgui.text_disabled("Without light, the medium shows its own colours.")


def _reflection(lighting: Lighting, scene: Scene) -> dict[str, Any]:
    wanted: dict[str, Any] = {}
    for name, most in (("ambient", 1.0), ("diffuse", 1.5), ("specular", 1.5), ("shininess", 128.0)):
        wanted[name] = parts.slider(name, getattr(lighting, name), 0.0, most, "%.2f")
    wanted["two_sided"] = parts.switch("two-sided", lighting.two_sided)
    if scene.mode == "composite" and not scene.added:
        imgui.same_line()
        wanted["shadows"] = parts.switch("shadows", lighting.shadows)
    return wanted


def _lights(lights: tuple[Light, ...], scene: Scene) -> tuple[Light, ...]:
    wanted = []
    for position, light in enumerate(lights):
        imgui.push_id(position)
        edited = _light(light, scene)
        imgui.same_line()
        if not imgui.small_button("remove"):
            wanted.append(edited)
        imgui.set_item_tooltip("take this light away; the switch above keeps it")
        imgui.pop_id()
    if len(lights) < _MOST_LIGHTS and imgui.button("add a light"):
        wanted.append(Light("directional", (-1.0, -1.0, 1.0)))
    if len(lights) < _MOST_LIGHTS:
        imgui.set_item_tooltip("one more, from a direction")
    return tuple(wanted)


def _light(light: Light, scene: Scene) -> Light:
    kind: Any = parts.choice("kind", light.kind, LIGHT_KINDS)
    if kind != light.kind:
        above = triple(scene.box.centre + [0, 0, 2 * scene.box.radius])
        return Light(kind, {"head": None, "directional": (0.0, 0.0, 1.0), "point": above}[kind], light.color)
    if light.vector is not None:
        most = 1.0 if kind == "directional" else float(np.abs(light.vector).max() + scene.box.radius)
        label = "from" if kind == "directional" else "at"
        changed, vector = imgui.drag_float3(label, list(light.vector), most / 200, 0, 0, "%.3g")
        imgui.set_item_tooltip("direction or point from which the light comes; drag, or double-click to type")
        if changed and any(vector):
            return replace(light, vector=triple(vector))
    brightest = max(*light.color, 1.0)
    shown = triple(each / brightest for each in light.color)
    color = parts.color("colour", shown)
    return light if color == shown else replace(light, color=triple(each * brightest for each in color))
