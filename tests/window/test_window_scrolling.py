"""Panels scroll by drags, as fingers make them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from imgui_bundle import imgui

from texvol.window.panels import scrolling

ROWS = 40


class Page:
    """A window of text, with a button in each second row, and a list in it that scrolls by itself."""

    def __init__(self) -> None:
        self.state: dict[str, Any] = {}
        self.pressed = 0
        self.scrolled = [0.0, 0.0]  # of the window and of the list
        self.places: dict[str, tuple[float, float]] = {}

    def frame(self) -> None:
        io = imgui.get_io()
        io.display_size, io.delta_time = imgui.ImVec2(300, 200), 1 / 60
        imgui.new_frame()
        imgui.set_next_window_pos(imgui.ImVec2(0, 0))
        imgui.set_next_window_size(imgui.ImVec2(200, 200))
        imgui.begin("page", None, imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move)
        imgui.begin_child("list", imgui.ImVec2(0, 60))
        self._rows("list")
        self.scrolled[1] = imgui.get_scroll_y()
        imgui.end_child()
        self._rows("page")
        self.scrolled[0] = imgui.get_scroll_y()
        imgui.end()
        scrolling.drag(self.state)
        imgui.render()

    def _rows(self, name: str) -> None:
        for row in range(ROWS):
            if row % 2:
                self.pressed += imgui.button(f"button {row}")
            else:
                imgui.text(f"text {row}")
            start, end = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            self.places[f"{name} {row}"] = ((start.x + end.x) / 2, (start.y + end.y) / 2)

    def drag(self, where: tuple[float, float], by: float, button: int) -> None:
        io = imgui.get_io()
        io.add_mouse_pos_event(*where)
        self.frame()
        io.add_mouse_button_event(button, True)
        self.frame()
        for step in range(1, 4):
            io.add_mouse_pos_event(where[0], where[1] + by * step / 3)
            self.frame()
        io.add_mouse_button_event(button, False)
        self.frame()
        io.add_mouse_pos_event(where[0], where[1])  # no button is down: nothing follows
        self.frame()


@pytest.fixture
def page() -> Iterator[Page]:
    before, context = imgui.get_current_context(), imgui.create_context()
    imgui.set_current_context(context)
    io = imgui.get_io()
    io.backend_flags |= imgui.BackendFlags_.renderer_has_textures.value
    io.set_ini_filename("")
    page = Page()
    for _ in range(3):
        page.frame()
    yield page
    imgui.destroy_context(context)
    if before is not None:
        imgui.set_current_context(before)


def on(name: str) -> Callable[[Page], tuple[float, float]]:
    return lambda page: page.places[name]


@pytest.mark.parametrize(
    "where, button, scrolled",
    [
        (on("page 0"), 0, (30, 0)),
        (on("page 0"), 2, (30, 0)),
        (on("page 1"), 0, (0, 0)),  # one finger is the button's
        (on("page 1"), 2, (30, 0)),
        (on("list 0"), 0, (0, 30)),
        (on("list 1"), 2, (0, 30)),
        (lambda page: (280, 100), 2, (0, 0)),  # beside it
    ],
)
def test_a_drag_scrolls_what_is_under_it(
    page: Page, where: Callable[[Page], tuple[float, float]], button: int, scrolled: tuple[float, float]
) -> None:
    place = where(page)
    page.drag(place, -30.0, button)
    assert page.scrolled == pytest.approx(scrolled, abs=1)
    assert page.pressed == 0
    page.drag(place, 500.0, button)
    assert page.scrolled == [0, 0]
