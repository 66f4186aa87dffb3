"""The screen of a window without a display draws what Dear ImGui lists, where and in the colour that it says."""

from __future__ import annotations

import numpy as np
import pytest
from imgui_bundle import imgui

from texvol.window.events import Event, Queue
from texvol.window.interface import Interface
from texvol.window.remote.exchange import Exchange
from texvol.window.remote.off_screen import OffScreen
from texvol.window.screen import Textures


@pytest.mark.parametrize("backend", ["egl", "osmesa"])
def test_rectangles_pictures_and_letters_are_in_their_places(backend: str) -> None:
    exchange, heard = Exchange(), Queue()
    screen = OffScreen(exchange, backend, (40, 30), "window", heard.put)
    try:
        interface = Interface(screen)
        textures = Textures(screen)
        pictured = np.arange(5 * 4 * 3, dtype=np.uint8).reshape(5, 4, 3)
        exchange.ask_size(object(), (48, 32, 1))  # of nobody that looks
        screen.wait(0)
        assert (screen.size, heard.take()) == ((40, 30), [])
        screen.resize((48, 32))
        for _ in range(2):  # letters are made in the first frame
            interface.begin([])
            drawn = imgui.get_background_draw_list()
            drawn.add_rect_filled(imgui.ImVec2(2, 3), imgui.ImVec2(12, 8), 0xFF_30_20_10)
            texture = imgui.ImTextureRef(textures.get("picture", 1, lambda: pictured))
            drawn.add_image(texture, imgui.ImVec2(20, 10), imgui.ImVec2(24, 15))
            drawn.add_text(imgui.ImVec2(28, 8), 0xFF_FF_FF_FF, "o")
            # A texture that a list of the frame names stays until that is drawn, though another one replaces it.
            for key, shape in ((1, (3, 3, 3)), (2, (2, 2, 3))):
                pixels = np.full(shape, 10 * key, np.uint8)
                number = textures.get("replaced", key, lambda pixels=pixels: pixels)
                drawn.add_image(imgui.ImTextureRef(number), imgui.ImVec2(40 * key - 40, 28), imgui.ImVec2(40, 30))
            screen.clear((0.0, 0.0, 1.0))
            interface.end()
            textures.drawn()
            screen.check()
        seen = screen.read().astype(int)
        for event, is_quick in (
            (Event("move", 5, 5), True), (Event("button", name="left", down=True), False), (Event("move", 8, 5), False),
            (Event("move", 12, 5), True),
        ):  # fmt: skip
            interface.begin([event])
            interface.end()
            assert (imgui.get_style().hover_delay_short < 1) == is_quick, "a press hides tooltips"
        interface.close()
    finally:
        screen.close()
    assert seen.shape == (32, 48, 3)
    assert (seen[3:8, 2:12] == (0x10, 0x20, 0x30)).all()
    assert (seen[10:15, 20:24] == pictured).all()
    letter = seen[8:24, 28:40]
    assert letter[..., 0].max() > 128
    assert (letter[..., 2] == 255).all()  # white over blue
    rest = np.ones((32, 48), bool)
    rest[3:8, 2:12] = rest[10:15, 20:24] = rest[8:24, 28:40] = rest[28:30, :40] = False
    assert (seen[28:30, :40] == 10).all()
    assert (seen[rest] == (0, 0, 255)).all()


def test_a_flood_of_events_is_refused_and_does_not_grow_in_the_window() -> None:
    exchange, queue = Exchange(), Queue()
    screen = OffScreen(exchange, "auto", (40, 30), "window", queue.put)
    try:
        clicks = [Event("button", name="left", down=bool(number % 2)) for number in range(256)]
        refused = 0
        for _ in range(100):  # frames, of which each uses one click
            refused += not exchange.put(clicks)
            screen.wait(0)
            queue.take()
        left = queue.put(Event("focus"))
    finally:
        screen.close()
    assert refused > 70
    assert left < 600
