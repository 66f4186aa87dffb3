"""Light tab: sets of lights, a sphere on which lights are placed, each light, and the reflection of the medium."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.scene.light_sets import LIGHT_SETS, light_set
from texvol.scene.lighting import LIGHT_KINDS, Light, Lighting
from texvol.scene.looks import EXPOSED
from texvol.scene.scene import Scene
from texvol.window import switched
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.navigation import triple
from texvol.window.panels import light_sphere, parts, tips

_MOST_LIGHTS = 8
_BRIGHTEST = 2.0  # of the slider
_FAINTEST = 0.01  # a light of no brightness would lose its colour
_LABELS = 92.0  # width of the labels beside the controls of a light, window coordinates at scale 1


def show(desk: Desk, document: Document) -> None:
    """Show the Light tab."""
    scene = document.scene
    lighting = scene.lighting
    on = parts.switch("light", lighting is not None)
    if on != (lighting is not None):
        desk.change(**switched.light_switched(scene, document.off))
        return
    pressed = parts.buttons(["head", *LIGHT_SETS], 1 + len(LIGHT_SETS))
    if pressed:
        desk.change(lighting=_set_of_lights(document, pressed))
    elif lighting is not None:
        wanted: dict[str, Any] = {"lights": light_sphere.show(desk, document, lighting)}
        imgui.separator_text("Lights")
        wanted["lights"] = _lights(desk, wanted["lights"], scene)
        imgui.separator_text("Reflection")
        wanted |= _reflection(lighting, scene)
        desk.attempt(lambda: desk.change("lighting", lighting=replace(lighting, **wanted)))
    elif scene.mode == "isosurface":
        parts.note("One light at the eye is used until you switch lights on.")
    else:
        parts.note("Without light, the medium shows its own colours.")


def _set_of_lights(document: Document, name: str) -> Lighting:
    """Return a set of lights, placed for the current view; shadows and fading stay as they are."""
    found = EXPOSED if name == "head" else light_set(name, document.view.camera)
    before = document.scene.lighting or document.off.lighting
    if before is None:
        return found
    shadows = before.shadows and document.scene.mode == "composite" and not document.scene.added
    return replace(found, fade=before.fade, shadows=shadows)


def _reflection(lighting: Lighting, scene: Scene) -> dict[str, Any]:
    wanted: dict[str, Any] = {}
    for name, most in (("ambient", 1.0), ("diffuse", 1.5), ("specular", 1.5), ("shininess", 128.0)):
        wanted[name] = parts.slider(name, getattr(lighting, name), 0.0, most, "%.2f")
    wanted["two_sided"] = parts.switch("two-sided", lighting.two_sided)
    if scene.mode == "composite" and not scene.added:
        imgui.same_line()
        wanted["shadows"] = parts.switch("shadows", lighting.shadows)
    return wanted


def _lights(desk: Desk, lights: tuple[Light, ...], scene: Scene) -> tuple[Light, ...]:
    wanted = []
    imgui.push_item_width(imgui.get_content_region_avail().x - _LABELS * parts.scale())
    for position, light in enumerate(lights):
        imgui.push_id(position)
        if position:
            imgui.spacing()
        edited, stays = _light(desk, position, light, scene)
        if stays:
            wanted.append(edited)
        imgui.pop_id()
    imgui.pop_item_width()
    if len(lights) < _MOST_LIGHTS:
        if imgui.button("add a light"):
            desk.panel_state["light"] = len(wanted)
            wanted.append(Light("directional", (-1.0, -1.0, 1.0)))
        imgui.set_item_tooltip("one more, from a direction")
    return tuple(wanted)


def _light(desk: Desk, position: int, light: Light, scene: Scene) -> tuple[Light, bool]:
    """Show the controls of a light; return it, and False if it is to be removed."""
    selected = desk.panel_state.get("light") == position
    end = imgui.get_cursor_pos().x + imgui.get_content_region_avail().x
    if imgui.radio_button(f"light {position + 1}", selected):
        desk.panel_state["light"] = None if selected else position
    imgui.set_item_tooltip("mark it on the sphere")
    imgui.same_line()
    brightness = max(*light.color, _FAINTEST)
    shown = triple(each / brightness for each in light.color)
    color = parts.color("##light color", shown, small=True)
    imgui.same_line(end - imgui.calc_text_size("remove").x - 2 * imgui.get_style().frame_padding.x)
    stays = not imgui.small_button("remove")
    imgui.set_item_tooltip("take this light away; the switch above keeps it")
    light = _kind(light, scene)
    wanted = parts.slider("brightness", brightness, 0.0, max(_BRIGHTEST, brightness), "%.2f")
    if color != shown or wanted != brightness:
        light = replace(light, color=triple(each * max(wanted, _FAINTEST) for each in color))
    return light, stays


def _kind(light: Light, scene: Scene) -> Light:
    """Show the kind and the direction or position of a light."""
    kind: Any = parts.choice("kind", light.kind, LIGHT_KINDS)
    if kind != light.kind:
        above = triple(scene.box.centre + [0, 0, 2 * scene.box.radius])
        return Light(kind, {"head": None, "directional": (0.0, 0.0, 1.0), "point": above}[kind], light.color)
    if light.vector is None:
        return light
    most = 1.0 if kind == "directional" else float(np.abs(light.vector).max() + scene.box.radius)
    label = "from" if kind == "directional" else "at"
    changed, vector = imgui.drag_float3(label, list(light.vector), most / 200, 0, 0, "%.3g")
    tips.show(label)
    return replace(light, vector=triple(vector)) if changed and any(vector) else light
