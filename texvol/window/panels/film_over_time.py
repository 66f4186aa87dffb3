"""Film over time in the File tab: one picture for each time step of the scene."""

from __future__ import annotations

from imgui_bundle import imgui

from texvol.window import exporting, time_film
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.panels import film, parts


def show(desk: Desk, document: Document) -> None:
    """Show the controls, if the scene has several time steps."""
    if not desk.times.has_steps:
        return
    imgui.separator_text("Film: over time")
    imgui.push_id("over time")
    state = desk.panel_state
    if not state.get("time film name"):
        state["time film name"] = exporting.proposed(desk, document, "-time.mp4")
    fps = parts.number("frames per second", state.get("time fps", desk.times.pace))
    imgui.set_item_tooltip("time steps per second of a film; numbered pictures have none")
    if 0.1 <= fps <= 1000:
        state["time fps"] = fps
    size = desk.panel_state.get("picture size", desk.layout.alone(desk.pixels))
    film.cost(desk, document, size, desk.times.count, fps)
    imgui.set_next_item_width(-110 * parts.scale())
    _, state["time film name"] = imgui.input_text("##name", state["time film name"])
    imgui.set_item_tooltip("MP4, GIF, or numbered pictures such as step_%03d.png")
    imgui.same_line()
    if imgui.button("…"):
        name = str(state["time film name"])
        desk.browse("Save as", lambda path, _: state.update({"time film name": path}), saves=True, name=name)
    imgui.set_item_tooltip("choose a folder")
    imgui.same_line()
    _save(desk, document, fps)
    imgui.pop_id()


def _save(desk: Desk, document: Document, fps: float) -> None:
    """Show the button that begins to write, or stops what is being written."""
    if desk.writing is not None:
        if imgui.button("stop"):
            desk.stop_writing()
        imgui.set_item_tooltip("stop writing; what waits to be written is dropped as well")
    elif imgui.button("save"):
        width, height = desk.panel_state.get("picture size", desk.layout.alone(desk.pixels))
        size = max(width - width % 2, 2), max(height - height % 2, 2)
        time_film.film(desk, document, desk.panel_state["time film name"], size, fps)
    else:
        imgui.set_item_tooltip(f"{desk.times.count} time steps from this view, as a film or as numbered pictures")
