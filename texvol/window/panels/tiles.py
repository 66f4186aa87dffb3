"""Slices beside the 3D view, in the picture area: one tile for each, with the mouse on it.

A drag with the left button moves the crosshair, with the middle button the slice; with the right button it changes
window and level. The wheel goes through the slices, with ctrl it zooms at the cursor. A double click makes a slice the
large one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from imgui_bundle import imgui

from texvol.scene.scene import Scene
from texvol.window import probe
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.editing import owner_of
from texvol.window.layout import PICTURE, Layout
from texvol.window.measure_slices import SliceMap
from texvol.window.panels import measure_in_slices, parts
from texvol.window.slice_layers import Colors, Layer, first_layer, further_layer, hue_of
from texvol.window.slice_views import Plane, SliceView
from texvol.window.slices import NAMES, letters_of
from texvol.window.steering import Viewport

# Colours of planes, ABGR without alpha: those of the axes that they are perpendicular to, red, green and blue.
COLORS = {"sagittal": 0x5A_5A_FF, "coronal": 0x64_D2_5A, "axial": 0xFF_96_50}
_LINE, _BORDER, _TITLE = 0xB0_00_00_00, 0xFF_00_00_00, 0xFF_00_00_00  # alpha
_GROUND = 0xD0_0C_0B_0B  # of headings and letters
_BEHIND = 0xFF_0C_0B_0B
_WINDOWING = 300.0  # window coordinates: a drag of this length changes the window by all values
_ZOOM = 1.15  # for one notch of the wheel
_SMALLEST = 40.0  # window coordinates at scale 1: a smaller view has no room for a slice
_SIDES = ((0.0, 0.5), (1.0, 0.5), (0.5, 0.0), (0.5, 1.0))  # left, right, top, bottom
_BUTTONS = imgui.ButtonFlags_.mouse_button_left | imgui.ButtonFlags_.mouse_button_right
_BUTTONS |= imgui.ButtonFlags_.mouse_button_middle
_FLAGS = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_nav
_FLAGS |= imgui.WindowFlags_.no_bring_to_front_on_focus | imgui.WindowFlags_.no_scroll_with_mouse
_FLAGS |= imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_focus_on_appearing
_ICON = 22.0  # window coordinates at scale 1


def show(desk: Desk) -> None:
    """Show the tiles, if slices are shown beside the 3D view."""
    document, layout = desk.document, desk.layout
    layout.views, layout.hovered = {}, None
    if document is None:
        return
    layout.follow(document.scene)
    for name in NAMES:
        rectangle = layout.rectangles.get(name)
        if rectangle is not None:
            _tile(desk, document, name, rectangle)


def _tile(desk: Desk, document: Document, name: str, rectangle: Viewport) -> None:
    imgui.set_next_window_pos(imgui.ImVec2(rectangle.x, rectangle.y))
    imgui.set_next_window_size(imgui.ImVec2(rectangle.width, rectangle.height))
    imgui.push_style_var(imgui.StyleVar_.window_padding, imgui.ImVec2(0, 0))
    imgui.push_style_var(imgui.StyleVar_.window_rounding, 0.0)
    imgui.begin(f"slice {name}", None, _FLAGS)
    imgui.pop_style_var(2)
    is_large_enough = min(rectangle.width, rectangle.height) >= _SMALLEST * parts.scale()
    if is_large_enough and (slice_in(desk, document, name, rectangle) or expand(desk, name, rectangle)):
        desk.layout.swap(name)
    imgui.end()


def slice_in(desk: Desk, document: Document, name: str, rectangle: Viewport) -> bool:
    """Show a slice in a rectangle of the current window, process the mouse on it, and return True at a double click."""
    layout, scene = desk.layout, document.scene
    slice_ = layout.slices[name]
    plane = Plane.of(scene.volume, slice_, layout.number(name))
    view = SliceView.of(rectangle, plane, scene.volume, layout.zoom, layout.middle)
    layout.views[name] = view
    draw = imgui.get_window_draw_list()
    corner, end = parts.corners(rectangle)
    draw.push_clip_rect(corner, end, True)
    draw.add_rect_filled(corner, end, _BEHIND)
    for number, layer in enumerate(layers_of(desk, scene, name, plane)):
        _image(desk, draw, view, f"{name} {number}", layer, layout.opacity if number else 1.0)
    _lines(draw, layout, view, name)
    _texts(draw, layout, view, name)
    imgui.set_cursor_screen_pos(corner)
    imgui.set_next_item_allow_overlap()
    imgui.invisible_button(name, imgui.ImVec2(rectangle.width, rectangle.height), _BUTTONS)
    imgui.set_item_key_owner(imgui.Key.mouse_wheel_y)  # the wheel does not scroll the panel
    seen = SliceMap.of(view, scene.volume, slice_)
    is_of_measure = measure_in_slices.show(desk, document, seen, name, hovered=imgui.is_item_hovered())
    clicked = not is_of_measure and _mouse(desk, scene, view, name)
    draw.pop_clip_rect()
    return clicked


def layers_of(desk: Desk, scene: Scene, name: str, plane: Plane) -> list[Layer]:
    """Return the pictures of all volumes in the plane of a slice; those of further volumes are coarser in a drag."""
    layout = desk.layout
    slice_, fine = layout.slices[name], not imgui.is_mouse_down(0)
    colors = _colors(desk, scene, 0) if scene.volume.labels else None
    layers = [first_layer(scene.volume, colors, slice_, layout.number(name), layout.window, hue_of(scene))]
    for number, added in enumerate(scene.added, 1):
        found = _colors(desk, scene, number)
        layer = None if found is None else further_layer(added.volume, found, plane, fine=fine)
        layers += [] if layer is None else [layer]
    return layers


def _colors(desk: Desk, scene: Scene, number: int) -> Colors | None:
    """Return the table of a volume's colours, made anew when its transfer function has changed."""
    owner = owner_of(scene, number)
    medium = owner.transfer_function if number == 0 else scene.added[number - 1].medium
    if medium is None:
        return None
    known: dict[int, tuple[Any, Colors]] = desk.panel_state.setdefault("slice colors", {})
    if number not in known or known[number][0] is not owner.volume or known[number][1].medium is not medium:
        known[number] = owner.volume, Colors(owner.volume, medium)
    return known[number][1]


def _image(desk: Desk, draw: Any, view: SliceView, name: str, layer: Layer, opacity: float) -> None:
    assert desk.textures is not None
    texture = imgui.ImTextureRef(desk.textures.get(f"slice {name}", layer.key, layer.make, nearest=layer.nearest))
    places = [imgui.ImVec2(*view.place(*corner)) for corner in layer.corners]
    whole = [imgui.ImVec2(0, 0), imgui.ImVec2(1, 0), imgui.ImVec2(1, 1), imgui.ImVec2(0, 1)]
    draw.add_image_quad(texture, *places, *whole, round(255 * opacity) << 24 | 0xFF_FF_FF)


def _lines(draw: Any, layout: Layout, view: SliceView, name: str) -> None:
    """Draw the crosshair: a line in the colour of each plane that the slice meets."""
    x, y = view.place(*view.plane.position(layout.crosshair))
    box, width = view.rectangle, parts.scale()
    for other in NAMES:
        axis = layout.slices[other].axis
        if other == name:
            continue
        is_across = axis == layout.slices[name].across[0]  # such a plane is a vertical line
        start = imgui.ImVec2(x, box.y) if is_across else imgui.ImVec2(box.x, y)
        end = imgui.ImVec2(x, box.y + box.height) if is_across else imgui.ImVec2(box.x + box.width, y)
        draw.add_line(start, end, COLORS[other] | _LINE, width)


def _texts(draw: Any, layout: Layout, view: SliceView, name: str) -> None:
    """Draw the border, the name with the slice's number, the zoom, and the directions of the body."""
    assert layout.volume is not None
    box, scale = view.rectangle, parts.scale()
    corner, end = (
        imgui.ImVec2(round(box.x), round(box.y)),
        imgui.ImVec2(int(box.x + box.width), int(box.y + box.height)),
    )
    draw.add_rect(corner, end, COLORS[name] | _BORDER, 0.0, thickness=1.5 * scale)
    margin = 8 * scale
    count = layout.volume.dimensions[layout.slices[name].axis]
    titles = [f"{name} {layout.number(name) + 1} of {count}", f"{name} {layout.number(name) + 1}", name]
    titles = [f"{each}, {layout.zoom:.3g} x" if layout.zoom != 1 else each for each in titles]
    room = box.width / 2 - 3 * margin  # up to the letter in the middle
    title = next((each for each in titles if imgui.calc_text_size(each).x <= room), "")
    _heading(box.x + margin, box.y + margin, title, COLORS[name] | _TITLE)
    for letter, (across, below) in zip(letters_of(layout.volume, layout.slices[name]) or (), _SIDES, strict=False):
        extent = imgui.calc_text_size(letter)
        x = box.x + margin + across * (box.width - extent.x - 2 * margin)
        y = box.y + margin + below * (box.height - extent.y - 2 * margin)
        _heading(x, y, letter, 0xFF_FF_FF_FF)  # the crosshair may lie behind it


def _heading(x: float, y: float, text: str, color: int) -> None:
    """Draw text on a dark ground: an outline alone leaves coloured letters hard to read on a bright slice."""
    if text:
        extent, margin = imgui.calc_text_size(text), 4 * parts.scale()
        start, end = (
            imgui.ImVec2(x - margin, y - margin / 2),
            imgui.ImVec2(x + extent.x + margin, y + extent.y + margin),
        )
        imgui.get_window_draw_list().add_rect_filled(start, end, _GROUND, margin)
        _text(x, y, text, color)


def _text(x: float, y: float, text: str, color: int) -> None:
    """Draw text with a dark border, legible on any background."""
    draw = imgui.get_window_draw_list()
    for right, down in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        draw.add_text(imgui.ImVec2(x + right, y + down), 0xC0_00_00_00, text)
    draw.add_text(imgui.ImVec2(x, y), color, text)


def _mouse(desk: Desk, scene: Scene, view: SliceView, name: str) -> bool:
    """Process the mouse on the last item, a slice; return True at a double click."""
    layout, state, io = desk.layout, desk.panel_state, imgui.get_io()
    over, here = imgui.is_item_hovered(), view.point(io.mouse_pos.x, io.mouse_pos.y)
    if over and desk.preferences.probe:
        layout.hovered = probe.at_point(scene, here)
    _windowing(desk)
    if not imgui.is_mouse_down(0):
        state["slice clicked"] = False
    clicked = over and imgui.is_mouse_double_clicked(0)
    if clicked:
        state["slice clicked"] = True  # the crosshair stays until the button is released
    elif imgui.is_item_active() and imgui.is_mouse_down(0) and not state.get("slice clicked"):
        layout.move_to(here, keep=layout.slices[name].axis)
    elif imgui.is_item_active() and imgui.is_mouse_down(2):
        moved = io.mouse_delta.x * view.plane.right + io.mouse_delta.y * view.plane.down
        layout.middle = view.centre - moved / view.scale
    elif over and io.mouse_wheel:
        if io.key_ctrl:
            layout.magnify(_ZOOM**io.mouse_wheel, here, view.centre)
        else:
            turned = state.get("slice wheel", 0.0) + io.mouse_wheel  # a fine wheel turns by parts of a notch
            state["slice wheel"] = turned - np.trunc(turned)
            layout.step(name, float(np.trunc(turned)))
    return bool(clicked)


def _windowing(desk: Desk) -> None:
    """Process a drag with the right button in the last item: sideways changes the window, upwards the level."""
    layout, state, io = desk.layout, desk.panel_state, imgui.get_io()
    assert layout.volume is not None
    if imgui.is_item_hovered() and imgui.is_mouse_clicked(1):
        state["windowing"] = imgui.get_item_id()
    if not io.mouse_down[1]:
        state["windowing"] = None
    elif state.get("windowing") == imgui.get_item_id():
        low, high = layout.volume.finite_range or (0.0, 1.0)
        step = (high - low) / _WINDOWING
        centre, width = layout.window
        centre = min(max(centre - step * io.mouse_delta.y, low), high)
        layout.window = centre, max(width + step * io.mouse_delta.x, 1e-3 * (high - low), 1e-300)


def expand(desk: Desk, name: str, rectangle: Viewport) -> bool:
    """Show the button in the upper right corner that makes a view large or small again; return True if pressed."""
    side = _ICON * parts.scale()
    is_large = desk.layout.large == name
    tip = "all views of one size (double click)" if is_large else "make this view the large one (double click)"
    x, y = rectangle.x + rectangle.width - 1.25 * side, rectangle.y + 0.25 * side
    return icon(f"large {name}", "grid" if is_large else "one", tip, x, y)


def icon(name: str, kind: str, tip: str, x: float, y: float) -> bool:
    """Show a small button with a frame in it ("one"), divided in four ("grid"), or filled ("whole")."""
    side, scale = _ICON * parts.scale(), parts.scale()
    imgui.set_cursor_screen_pos(imgui.ImVec2(x, y))
    pressed = bool(imgui.invisible_button(name, imgui.ImVec2(side, side)))
    imgui.set_item_tooltip(tip)
    draw, shade = imgui.get_window_draw_list(), 0xFF_FF_FF_FF if imgui.is_item_hovered() else 0xB0_FF_FF_FF
    draw.add_rect_filled(imgui.ImVec2(x, y), imgui.ImVec2(x + side, y + side), 0x90_20_1C_1A, 3 * scale)
    left, top, right, bottom = x + 0.25 * side, y + 0.25 * side, x + 0.75 * side, y + 0.75 * side
    draw.add_rect(imgui.ImVec2(left, top), imgui.ImVec2(right, bottom), shade, 0.0, 1.5 * scale)
    if kind == "grid":
        draw.add_line(imgui.ImVec2(x + side / 2, top), imgui.ImVec2(x + side / 2, bottom), shade, 1.5 * scale)
        draw.add_line(imgui.ImVec2(left, y + side / 2), imgui.ImVec2(right, y + side / 2), shade, 1.5 * scale)
    elif kind == "one":
        draw.add_rect_filled(imgui.ImVec2(left, top), imgui.ImVec2(right, top + 0.15 * side), shade)
    else:
        draw.add_rect_filled(imgui.ImVec2(left, top), imgui.ImVec2(right, bottom), shade)
    return pressed


def switches(desk: Desk) -> None:
    """Show the buttons of the layout in the upper right corner of the 3D view.

    While the 3D view is alone, the button is there only when the mouse is near: the picture is all that is seen.
    """
    layout, viewport, side = desk.layout, desk.viewport, _ICON * parts.scale()
    if desk.document is None or not desk.preferences.panels or min(viewport.width, viewport.height) < 4 * side:
        return
    right = viewport.x + viewport.width
    if not layout.shown and not _is_near(desk, right, viewport.y, 4 * side):
        return
    count = 2 if layout.shown else 1
    imgui.set_next_window_pos(imgui.ImVec2(right - (1.25 * count + 0.05) * side, viewport.y + 0.2 * side))
    imgui.set_next_window_size(imgui.ImVec2((1.25 * count) * side, 1.1 * side))
    imgui.push_style_var(imgui.StyleVar_.window_padding, imgui.ImVec2(0, 0))
    imgui.begin("layout", None, _FLAGS | imgui.WindowFlags_.no_background)
    imgui.pop_style_var()
    y = viewport.y + 0.25 * side
    if not layout.shown:
        if icon("2x2", "grid", "slices beside the 3D view (g)", right - 1.25 * side, y):
            layout.become("2x2")
    else:
        if icon("alone", "whole", "the 3D view alone (g)", right - 2.5 * side, y):
            layout.become(PICTURE)
        if expand(desk, PICTURE, viewport):
            layout.swap(PICTURE)
    imgui.end()


def _is_near(desk: Desk, x: float, y: float, distance: float) -> bool:
    """True if the mouse is in the picture and near a point, and drags nothing."""
    across, along = desk.steering.cursor
    is_near = 0 <= x - across < distance and 0 <= along - y < distance / 2
    return is_near and desk.viewport.holds(across, along) and not desk.steering.dragging
