"""Ground of a frame: the colours of the window below all that is drawn.

A driver fills the whole window with one colour, and then rectangles of it, in a small part of the time in which it
draws the same rectangles as triangles.
"""

from __future__ import annotations

from imgui_bundle import imgui

from texvol.window.desk import Desk
from texvol.window.steering import Viewport

Triple = tuple[float, float, float]

BEHIND = (0.05, 0.05, 0.055)  # without a picture


def color(desk: Desk) -> Triple:
    """Return the colour of most of the window: that of the picture's background if the picture fills the height."""
    shown, view = desk.director.shown, desk.viewport
    is_alone = (view.width, view.height) == (desk.layout.area.width, imgui.get_io().display_size.y)
    return shown.surroundings if shown is not None and is_alone else BEHIND


def lay(desk: Desk) -> None:
    """Fill the rectangles of other colours in the window, which has been cleared with `color`."""
    shown, whole, left = desk.director.shown, imgui.get_io().display_size, desk.layout.area.width
    if shown is not None and shown.surroundings != color(desk):
        _fill(desk, desk.viewport, shown.surroundings)
    if desk.preferences.panels:
        panel = imgui.get_style_color_vec4(imgui.Col_.window_bg)
        _fill(desk, Viewport(left, 0, max(whole.x - left, 0), whole.y), (panel.x, panel.y, panel.z))


def _fill(desk: Desk, place: Viewport, color: Triple) -> None:
    assert desk.textures is not None
    target, scale = desk.textures.target, imgui.get_io().display_framebuffer_scale
    left, right = (round(x * scale.x) for x in (place.x, place.x + place.width))
    top, bottom = (round(y * scale.y) for y in (place.y, place.y + place.height))
    height = desk.textures.gl.viewport[3]
    target.clear(*color, 1.0, viewport=(left, height - bottom, right - left, bottom - top))
