"""Place in the middle of an empty window: a file is dropped on it, or a recent file or a sample is opened there."""

from __future__ import annotations

from imgui_bundle import imgui

from texvol.window import commands, opening, recent
from texvol.window.desk import Desk
from texvol.window.panels import parts

_WIDTH = 380.0  # window coordinates at scale 1
_MOST = 6  # recent files


def show(desk: Desk) -> None:
    """Show the place in the middle of the empty picture."""
    if desk.document is not None or desk.loading is not None or desk.browser is not None:
        return
    viewport, scale = desk.viewport, parts.scale()
    width = min(_WIDTH * scale, max(viewport.width - 20, 120))
    middle = imgui.ImVec2(viewport.x + viewport.width / 2, viewport.y + viewport.height / 2)
    imgui.set_next_window_pos(middle, imgui.Cond_.always.value, imgui.ImVec2(0.5, 0.5))
    imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0), imgui.ImVec2(width, max(viewport.height, 1)))
    flags = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.always_auto_resize
    imgui.begin("empty", None, flags | imgui.WindowFlags_.no_focus_on_appearing)
    imgui.text_unformatted("Drop a volume or a scene here")
    parts.note("or choose one; F1 shows the keys.")
    imgui.spacing()
    if imgui.button("open a file …", imgui.ImVec2(-1, 0)):
        commands.run(desk, "open")
    imgui.set_item_tooltip("volumes, scenes and folders of slices (ctrl-o)")
    if imgui.button("open a sample", imgui.ImVec2(-1, 0)):
        opening.sample(desk)
    imgui.set_item_tooltip("an electron in a hydrogen atom, of which no file is needed")
    recently(desk, _MOST)
    imgui.end()


def recently(desk: Desk, most: int) -> None:
    """Show recent files; a click opens one."""
    state = desk.panel_state
    if "recent" not in state:
        state["recent"] = recent.files()
    if state["recent"]:
        imgui.separator_text("Recent")
    for number, each in enumerate(state["recent"][:most]):
        imgui.push_id(number)
        # The name of the row is that of its number: two files may be called the same, once shortened.
        if imgui.selectable(parts.fitting(each.text, imgui.get_content_region_avail().x), False)[0]:
            opening.open_file(desk, each.path, each.options)
        imgui.set_item_tooltip(f"{each.path}\n{each.text}" if each.how else each.path)
        imgui.pop_id()
