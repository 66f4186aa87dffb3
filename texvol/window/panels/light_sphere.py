"""Sphere of the Light tab: lights are dragged on it."""

from __future__ import annotations

from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.scene.lighting import Light, Lighting
from texvol.scene.scene import Scene
from texvol.util.color import srgb_from_linear
from texvol.window import light_sphere
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.light_sphere import Spot
from texvol.window.panels import parts

_DIAMETER = 168.0  # window coordinates at scale 1
_PIXELS = 168
_AIR = 10.0  # around the sphere, for lights at its rim
_DOT, _REACH = 6.5, 14.0  # radius of a light, and from where it can be picked
_DARK, _WHITE = 0xFF_10_10_10, 0xFF_FF_FF_FF  # ABGR


def show(desk: Desk, document: Document, lighting: Lighting) -> tuple[Light, ...]:
    """Show the sphere in the scene's light, with its lights; return the lights, one of which may have been dragged."""
    scene, camera, scale = document.scene, document.view.camera, parts.scale()
    wide, radius = imgui.get_content_region_avail().x, _DIAMETER * scale / 2
    corner, side = imgui.get_cursor_screen_pos(), 2 * (radius + _AIR * scale)
    left = corner.x + max((wide - side) / 2, 0.0)
    imgui.set_cursor_screen_pos(imgui.ImVec2(left, corner.y))
    imgui.invisible_button("sphere", imgui.ImVec2(side, side))
    held, over = imgui.is_item_active(), imgui.is_item_hovered()
    middle = imgui.ImVec2(left + side / 2, corner.y + side / 2)
    _draw_sphere(desk, scene, lighting, middle, radius)
    spots = [light_sphere.spot_of(each, camera, scene.box) for each in lighting.lights]
    mouse = imgui.get_io().mouse_pos
    at = (mouse.x - middle.x) / radius, (middle.y - mouse.y) / radius
    state = desk.panel_state
    nearest = _nearest(spots, at, _REACH * scale / radius)
    if imgui.is_item_activated():
        state["light held"] = nearest, None if nearest is None else spots[nearest]
        if nearest is not None:
            state["light"] = nearest
    chosen, start = state.get("light held", (None, None)) if held else (None, None)
    marked = chosen if held else nearest if over else None
    _draw_lights(lighting, spots, middle, radius, marked, state.get("light"))
    if over and not held:
        imgui.set_tooltip(_tip(lighting, spots, nearest))
    lights = list(lighting.lights)
    if chosen is not None and start is not None and chosen < len(lights) and imgui.is_mouse_dragging(0, 2.0):
        lights[chosen] = light_sphere.moved(lights[chosen], light_sphere.dragged(start, *at), camera, scene.box)
    return tuple(lights)


def _draw_sphere(desk: Desk, scene: Scene, lighting: Lighting, middle: imgui.ImVec2, radius: float) -> None:
    camera = scene.camera
    assert camera is not None
    if desk.textures is None:
        return
    background = imgui.get_style().color_(imgui.Col_.window_bg.value)
    around = np.array([background.x, background.y, background.z])
    turn = (*camera.right.tolist(), *camera.upward.tolist())
    key = lighting, turn, tuple(around.tolist())
    texture = desk.textures.get(
        "light sphere", key, lambda: light_sphere.shaded(lighting, camera, scene.box, _PIXELS, around)
    )
    first = imgui.ImVec2(middle.x - radius, middle.y - radius)
    last = imgui.ImVec2(middle.x + radius, middle.y + radius)
    imgui.get_window_draw_list().add_image(imgui.ImTextureRef(texture), first, last)


def _draw_lights(
    lighting: Lighting, spots: list[Spot], middle: imgui.ImVec2, radius: float, marked: int | None, selected: Any
) -> None:
    """Draw the lights: dots in front, rings behind; each with a dark and a white outline, in its colour."""
    drawn, scale = imgui.get_window_draw_list(), parts.scale()
    for number, (light, spot) in enumerate(zip(lighting.lights, spots, strict=True)):
        place = imgui.ImVec2(middle.x + spot.x * radius, middle.y - spot.y * radius)
        size = _DOT * scale * (1.25 if number == marked else 1.0)
        brightest = max(*light.color, 1e-9)
        shown = srgb_from_linear(np.array(light.color) / brightest)
        color = imgui.get_color_u32(parts.shade(shown))
        if spot.behind:
            drawn.add_circle(place, size, _DARK, 0, 5.0 * scale)
            drawn.add_circle(place, size, color, 0, 2.5 * scale)
        else:
            drawn.add_circle_filled(place, size + 1.5 * scale, _DARK)
            drawn.add_circle_filled(place, size, color)
        if number == selected:
            drawn.add_circle(place, size + 4.0 * scale, _WHITE, 0, 1.2 * scale)


def _nearest(spots: list[Spot], at: tuple[float, float], reach: float) -> int | None:
    """Return the light at a position; of two at one place, the one in front."""
    found = [
        (spot.behind, float(np.hypot(spot.x - at[0], spot.y - at[1])), number) for number, spot in enumerate(spots)
    ]
    near = [each for each in found if each[1] <= reach]
    return min(near)[2] if near else None


def _tip(lighting: Lighting, spots: list[Spot], nearest: int | None) -> str:
    if nearest is None:
        return "the lights of the scene as they are seen from here; drag one, also over the rim to behind"
    light, spot = lighting.lights[nearest], spots[nearest]
    if light.kind == "head":
        return f"light {nearest + 1} is at the eye; drag it to have it come from a direction"
    return f"light {nearest + 1}, from {'behind' if spot.behind else 'the front'}; drag it"
