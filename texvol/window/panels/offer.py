"""Question about volumes that were dropped while a scene is open: open them, or add them to the scene."""

from __future__ import annotations

from imgui_bundle import imgui

from texvol.window import contents, opening
from texvol.window.desk import Desk
from texvol.window.panels import parts

_WIDTH = 300.0  # window coordinates at scale 1


def show(desk: Desk) -> None:
    """Show the question until it is answered."""
    paths, document = desk.offered, desk.document
    if not paths or document is None:
        return
    viewport, scale = desk.viewport, parts.scale()
    middle = imgui.ImVec2(viewport.x + viewport.width / 2, viewport.y + viewport.height / 2)
    imgui.set_next_window_pos(middle, imgui.Cond_.appearing.value, imgui.ImVec2(0.5, 0.5))
    flags = imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_collapse
    _, stays = imgui.begin(f"{contents.named(paths)}###offer", True, flags)
    if imgui.is_window_appearing():
        imgui.set_window_focus()
    width = imgui.ImVec2(min(_WIDTH * scale, max(viewport.width - 40, 120)), 0)
    answers = {
        "open": "open and close this scene" if len(paths) == 1 else "open as one scene and close this one",
        "add": "add to the scene",
        **({"mask": "use as a mask of the volume"} if len(paths) == 1 and document.scene.mask is None else {}),
        "cancel": "cancel",
    }
    pressed = [name for name, text in answers.items() if imgui.button(text, width)]
    if document.unsaved:
        imgui.text_disabled("This scene has unsaved changes.")
    typing = imgui.is_any_item_active()
    if not typing and (imgui.is_key_pressed(imgui.Key.enter) or imgui.is_key_pressed(imgui.Key.keypad_enter)):
        pressed.append("open")
    if not stays or imgui.is_key_pressed(imgui.Key.escape):
        pressed.append("cancel")
    imgui.end()
    if pressed:
        desk.offered = ()
        _answer(desk, paths, pressed[0])


def _answer(desk: Desk, paths: tuple[str, ...], answer: str) -> None:
    assert desk.document is not None
    if answer == "open":
        opening.open_all(desk, paths)
    elif answer == "add":
        for path in paths:
            opening.add(desk, path)
    elif answer == "mask":
        opening.mask(desk, desk.document.scene.volume, paths[0])
