"""Orientation cube in the corner of the picture: a click turns to a face, an edge or a corner, a drag turns freely."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from imgui_bundle import imgui
from numpy.typing import NDArray

from texvol.scene.framing import ViewChoice, view_of
from texvol.window import cube, motion, navigation, sides
from texvol.window.cube import Pick
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.panels import parts

_EDGE = 25.0  # half of the cube's edge, window coordinates at scale 1
_MARGIN = 60.0  # from the picture's corner to the cube's middle
_BUTTONS = 28.0  # height of the buttons of the layout, which are in that corner beside slices
_REACH = 46.0  # radius of the cube with its corners
_LARGE, _LEAST = 480.0, 300.0  # of the picture's sides: below the first the cube shrinks, below the second it is hidden
_LEGEND = 0.25  # of the picture's height, from where on the legend has the right border
_CLICK = 4.0  # a mouse that moves less than this, in window coordinates, has clicked
_FACE, _LINE, _LETTER = (0.86, 0.88, 0.91), (0.30, 0.33, 0.38), (0.10, 0.12, 0.16)
_PICKED = (0.40, 0.70, 1.0)
_DARKEST = 0.55  # shade of a face that is seen edge on


def drag(desk: Desk) -> None:
    """Process clicks on the cube and drags of it."""
    moving, document, io = desk.moving, desk.document, imgui.get_io()
    if document is None or not _shows(desk):
        moving.pressed = None
        return
    mouse = io.mouse_pos
    if moving.pressed is not None:
        _held(desk, document, (mouse.x, mouse.y))
        return
    if io.want_capture_mouse or desk.steering.dragging or desk.gripping or _at(desk, (mouse.x, mouse.y)) is None:
        return
    desk.gripping = True
    if imgui.is_mouse_clicked(0):
        moving.pressed, moving.dragged = (mouse.x, mouse.y), False


def draw(desk: Desk) -> None:
    """Draw the cube over the picture."""
    document = desk.document
    if document is None or not _shows(desk):
        return
    camera, mouse = document.view.camera, imgui.get_io().mouse_pos
    middle, edge = _place(desk)
    over = _at(desk, (mouse.x, mouse.y)) if desk.gripping else None
    drawn, towards = imgui.get_background_draw_list(), -camera.forward
    names = sides.letters(document.scene.volume)
    for face in cube.visible_faces(camera):
        facing = max(float(face[1] * towards[face[0]]), 0.0)
        shade = _DARKEST + (1 - _DARKEST) * facing
        _fill(drawn, _points(cube.positions(camera, cube.patch(face)), middle, edge), _FACE, shade)
        if over is not None and over[face[0]] == face[1]:
            _fill(drawn, _points(cube.positions(camera, cube.patch(face, over)), middle, edge), _PICKED, 1.0)
        border = _points(cube.positions(camera, cube.patch(face)), middle, edge)
        for start, end in pairwise([*border, border[0]]):  # a polyline has long tips on a face that is seen edge on
            drawn.add_line(start, end, _color(_LINE, 1.0), 1.2 * parts.scale())
        for stroke in cube.letter_strokes(names[face], face, _up_on(document, face)):
            line = _points(cube.positions(camera, stroke), middle, edge)
            drawn.add_polyline(line, _color(_LETTER, 1.0, facing**0.5), 2.0 * parts.scale(), 0)
    if over is not None and desk.moving.pressed is None:
        imgui.set_tooltip(_tip(document, over))


def _held(desk: Desk, document: Document, now: tuple[float, float]) -> None:
    """Continue or end a drag of the cube."""
    moving, io = desk.moving, imgui.get_io()
    assert moving.pressed is not None
    right, down = now[0] - moving.pressed[0], now[1] - moving.pressed[1]
    desk.gripping = True
    if moving.dragged or np.hypot(right, down) > _CLICK * parts.scale():
        moving.dragged, moving.pressed = True, now
        # A drag over the cube turns by a quarter, so that its faces follow the mouse.
        turn = np.pi / 4 / (_EDGE * _scale(desk))
        view = navigation.orbit(document.view, right * turn, -down * turn, free=desk.steering.free)
        desk.attempt(lambda: document.look(view))
    if not io.mouse_down[0]:
        picked = None if moving.dragged else _at(desk, now)
        moving.pressed = None
        if picked is not None:
            turned = sides.turned_to(document.view, cube.direction(picked), document.scene.volume)
            motion.go(desk, document, turned)


def _shows(desk: Desk) -> bool:
    large = _smallest_side(desk) >= _LEAST * parts.scale()
    return desk.moving.cube and desk.preferences.panels and large and desk.director.shown is not None


def _smallest_side(desk: Desk) -> float:
    return float(min(desk.viewport.width, desk.viewport.height))


def _scale(desk: Desk) -> float:
    """Return the scale of the cube: that of the interface, and less in a small picture."""
    return min(parts.scale(), _smallest_side(desk) / _LARGE)


def _place(desk: Desk) -> tuple[tuple[float, float], float]:
    """Return the cube's middle and half of its edge, in window coordinates."""
    scale, viewport = _scale(desk), desk.viewport
    down = _MARGIN * scale + (_BUTTONS * parts.scale() if desk.layout.shown else 0.0)
    right = viewport.width - _MARGIN * scale
    assert desk.document is not None
    if desk.document.showing.annotation.legend and down + _REACH * scale > _LEGEND * viewport.height:
        right = _MARGIN * scale  # the other corner, where it does not cover the legend
    return (viewport.x + right, viewport.y + down), _EDGE * scale


def _at(desk: Desk, point: tuple[float, float]) -> Pick | None:
    """Return what of the cube lies at a point of the window."""
    assert desk.document is not None
    middle, edge = _place(desk)
    right, down = point[0] - middle[0], point[1] - middle[1]
    if np.hypot(right, down) > _REACH * _scale(desk):
        return None
    return cube.pick(desk.document.view.camera, (right / edge, -down / edge))


def _up_on(document: Document, face: tuple[int, int]) -> NDArray[np.float64]:
    """Return the direction that is up for the letters of a face."""
    volume = document.scene.volume
    vertical = sides.upright(volume)
    along = float(vertical[face[0]]) * face[1]
    if abs(along) < 0.5:
        return vertical
    return view_of(volume, ViewChoice("top" if along > 0 else "bottom"))[1].round()


def _tip(document: Document, picked: Pick) -> str:
    names = sides.letters(document.scene.volume)
    text = " ".join(names[axis, sign] for axis, sign in enumerate(picked) if sign)
    return f"look from {text}; drag to turn"


def _points(positions: NDArray[np.float64], middle: tuple[float, float], edge: float) -> list[Any]:
    return [imgui.ImVec2(middle[0] + edge * x, middle[1] - edge * y) for x, y in positions.tolist()]


def _fill(drawn: imgui.ImDrawList, points: list[Any], color: tuple[float, float, float], shade: float) -> None:
    white = imgui.get_font_tex_uv_white_pixel()
    # Without a smooth rim, which has long tips on a face that is seen edge on: the lines of the border are smooth.
    drawn.prim_reserve(6, 4)
    first, second, third, fourth = points
    drawn.prim_quad_uv(first, second, third, fourth, white, white, white, white, _color(color, shade))


def _color(color: tuple[float, float, float], shade: float, opacity: float = 1.0) -> int:
    red, green, blue = (each * shade for each in color)
    return int(imgui.get_color_u32(imgui.ImVec4(red, green, blue, opacity)))
