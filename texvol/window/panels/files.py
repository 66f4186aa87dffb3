"""File tab: opening of files; saving of scenes, pictures and films."""

from __future__ import annotations

import os
from collections.abc import Callable

from imgui_bundle import imgui

from texvol.window import commands, exporting, opening, saving
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.naming import shortened, volume_called
from texvol.window.panels import empty, film, film_over_time, parts


def show(desk: Desk) -> None:
    """Show the File tab."""
    _open(desk)
    document = desk.document
    if document is None:
        return
    imgui.separator_text("Scene")
    volume = document.scene.volume
    imgui.text_wrapped(volume_called(volume))
    size = " x ".join(map(str, volume.dimensions)) + f" {volume.dtype}"
    further = len(document.scene.added)
    imgui.text_disabled(size + (f", and {further} more" if further else ""))
    imgui.text_disabled("unsaved changes" if document.unsaved else " ")
    _saving(desk, document)
    imgui.separator_text("Picture")
    _picture(desk, document)
    film.show(desk, document, lambda: _name(desk, "film name", lambda: exporting.proposed(desk, document, ".mp4")))
    film_over_time.show(desk, document)


def _open(desk: Desk) -> None:
    imgui.separator_text("Open")
    state = desk.panel_state
    if imgui.button("open a file …", imgui.ImVec2(-1, 0)):
        commands.run(desk, "open")
    imgui.set_item_tooltip("volumes, scenes, meshes and transfer functions (ctrl-o)")
    imgui.set_next_item_width(-70 * parts.scale())
    entered, state["path"] = imgui.input_text_with_hint(
        "##path", "volume, scene.toml or tf.json", state.get("path", ""), imgui.InputTextFlags_.enter_returns_true
    )
    imgui.set_item_tooltip("path of a file; Enter opens it")
    imgui.same_line()
    pressed = imgui.button("open")
    imgui.set_item_tooltip("open the file of this name (Enter)")
    if (pressed or entered) and state["path"]:
        opening.open_file(desk, os.path.expanduser(state["path"]))
    _others(desk)
    empty.recently(desk, 6)


def _others(desk: Desk) -> None:
    """Show buttons that return to the scenes before and after the open one."""
    here = desk.document
    if here is None:
        return
    for name, document in (
        ("back", next(reversed(desk.replaced.past), None)),
        ("forward", next(reversed(desk.replaced.future), None)),
    ):
        if document is not None:
            changed = "*" if document.unsaved else ""
            if imgui.button(f"{name} to {shortened(document.name, 34)}{changed}##{name}", imgui.ImVec2(-1, 0)):
                commands.run(desk, name)
            imgui.set_item_tooltip("with its view, its steps and its unsaved changes (alt-left, alt-right)")


def _name(desk: Desk, key: str, proposed: Callable[[], str]) -> str:
    """Show the field of a file name to write, and return the name; a name is proposed until the user types one."""
    state = desk.panel_state
    if not state.get(key):
        state[key] = proposed()
    imgui.set_next_item_width(-110 * parts.scale())
    _, state[key] = imgui.input_text(f"##{key}", state[key])
    imgui.set_item_tooltip("name of the file to write; its ending decides the format")
    imgui.same_line()
    if imgui.button(f"…##{key}"):
        desk.browse("Save as", lambda path, _: state.update({key: path}), saves=True, name=str(state[key]))
    imgui.set_item_tooltip("choose a folder")
    imgui.same_line()
    return str(state[key])


def _saving(desk: Desk, document: Document) -> None:
    name = _name(desk, "scene name", lambda: saving.scene_name(document))
    if imgui.button("save##scene"):
        exporting.scene(desk, document, name, then=lambda: desk.panel_state.update({"scene name": ""}))
    imgui.set_item_tooltip("write the scene file (ctrl-s: the one in use); files of others are not replaced unasked")
    parts.steps(desk)
    imgui.same_line()
    if imgui.button("copy command line"):
        commands.run(desk, "copy-command")
    imgui.set_item_tooltip("the command that draws this picture, for a terminal (ctrl-shift-c)")


def _picture(desk: Desk, document: Document) -> None:
    state = desk.panel_state
    size = state.get("picture size", desk.layout.alone(desk.pixels))  # by default that of the 3D view without slices
    changed, wanted = imgui.input_int2("pixels", [int(each) for each in size])
    imgui.set_item_tooltip("width and height of pictures and films")
    if changed:
        state["picture size"] = [min(max(int(each), 1), 16384) for each in wanted]
    document.show(transparent=parts.switch("transparent background", document.showing.transparent))
    name = _name(desk, "picture name", lambda: exporting.proposed(desk, document, ".png"))
    if imgui.button("save##picture"):
        width, height = state.get("picture size", desk.layout.alone(desk.pixels))
        exporting.picture(desk, document, name, (width, height))
    imgui.set_item_tooltip("write the picture as it is at rest (p)")
