"""Film of the File tab: turns of the camera, or the path through the saved views."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from imgui_bundle import imgui

from texvol.scene.orbit import Turn
from texvol.scene.spaces import letters_of_space
from texvol.scene.tour import Tour
from texvol.util.time_left import duration
from texvol.window import exporting, film_accuracy, motion
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.panels import parts, writing

_AXES = {
    "up": "up in the world", "picture": "up in the picture", "head": "head of the body",
    "x": "x", "y": "y", "z": "z",
}  # fmt: skip
_DIRECTIONS = ("to the right", "to the left")
_COURSES = ("turns of the camera", "the saved views")
_MOST_TURNS = 100
_ERRORS = 0.5, 16.0  # of films, in steps of 8 bits


def show(desk: Desk, document: Document, name: Callable[[], str]) -> None:
    """Show what a film shows, and its file; `name` shows the field of the file's name, and returns the name."""
    imgui.separator_text("Film")
    state, moving = desk.panel_state, desk.moving
    moving.films_tour = parts.choice("film of", _COURSES[moving.films_tour], _COURSES) == _COURSES[1]
    fps = state.get("fps", 30.0)
    course: Turn | Tour = document.tour if moving.films_tour else moving.turn
    if isinstance(course, Turn):
        course = moving.turn = _turn(course, document)
        views = state["views"] = min(max(imgui.input_int("views", state.get("views", 120))[1], 1), 100_000)
        imgui.set_item_tooltip("pictures of the film")
    else:
        views = course.pictures(fps)
    entered = parts.number("frames per second", fps)
    if 0.1 <= entered <= 1000:
        state["fps"] = entered
    if isinstance(course, Tour) and len(course.views) < 2:
        parts.note("Save two views or more in the View tab; the film goes through them.")
        return
    size = state.get("picture size", desk.layout.alone(desk.pixels))
    cost(desk, document, size, views, fps)
    _preview(desk, document, course)
    path = name()
    if desk.writing is not None:
        if imgui.button("stop"):
            writing.stop(desk)
        imgui.set_item_tooltip("stop writing; what waits to be written is dropped as well")
        return
    if imgui.button("save##film"):
        exporting.film(desk, document, path, (size[0] - size[0] % 2, size[1] - size[1] % 2), views, fps, course)
    imgui.set_item_tooltip("write a film (MP4, GIF), or numbered pictures such as view_%03d.png")


def cost(desk: Desk, document: Document, size: tuple[int, int], pictures: int, fps: float) -> None:
    """Show the error of a film's pictures, how long the film is, and how long it takes to be written."""
    steps = desk.moving.film_error * 255
    wanted = parts.slider("error of films (/255)", steps, *_ERRORS, "%.2g")
    desk.moving.film_error = desk.moving.film_error if wanted == steps else wanted / 255
    seconds = film_accuracy.seconds(desk, document, size, pictures)
    writing_it = "" if seconds is None else f"; {duration(seconds)} or so to write"
    parts.note(f"{pictures} pictures, {pictures / fps:.3g} s{writing_it}")


def _turn(turn: Turn, document: Document) -> Turn:
    """Show axis, number and direction of turns; return the turn."""
    knows_head = letters_of_space(document.scene.volume.space) is not None
    names = {axis: text for axis, text in _AXES.items() if axis != "head" or knows_head}
    shown = parts.choice("axis", names.get(turn.axis, _AXES["up"]), list(names.values()))
    axis = next(each for each, text in names.items() if text == shown)
    turns = parts.number("turns", abs(turn.turns))
    turns = turns if 0 < turns <= _MOST_TURNS else abs(turn.turns)
    # A camera that turns counterclockwise, seen from above, goes to the right; the scene turns to the left.
    direction = parts.choice("camera goes", _DIRECTIONS[turn.turns < 0], _DIRECTIONS)
    return replace(turn, axis=axis, turns=turns if direction == _DIRECTIONS[0] else -turns)


def _preview(desk: Desk, document: Document, course: Turn | Tour) -> None:
    playing = desk.moving.motion
    if playing is not None and playing.name:
        if imgui.button("stop the preview"):
            motion.stop(desk)
        imgui.set_item_tooltip("stay where the camera is now")
        return
    if imgui.button("preview"):
        desk.attempt(lambda: motion.preview(desk, document, course))
    imgui.set_item_tooltip("show the moves of the camera here")
