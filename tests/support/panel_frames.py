"""Frames of the panels without a window, in which each control that is shown is noticed, with its tooltip."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from imgui_bundle import imgui, implot

from support.desks import desk_with
from texvol.window import panels
from texvol.window.desk import Desk
from texvol.window.director import Shown
from texvol.window.interface import _apply_style
from texvol.window.quality import Pace
from texvol.window.steering import Viewport

SIZE = (900, 1200)
# What is shown by these functions is a frame around controls.
FRAMES = {
    *("begin", "end", "begin_child", "end_child", "begin_tab_bar", "end_tab_bar", "begin_table", "end_table"),
    *("begin_popup_modal", "end_popup", "begin_group", "end_group", "end_tab_item", "begin_disabled", "end_disabled"),
    *("new_frame", "render", "end_frame", "table_next_column", "table_next_row", "separator", "separator_text"),
}
NEUTRAL = ("get_", "set_", "push_", "pop_", "is_", "calc_", "same_line", "dummy", "spacing")


@dataclass
class Seen:
    """Controls of frames, by the function that shows them and its label."""

    controls: set[tuple[str, str]] = field(default_factory=set)
    bare: set[tuple[str, str]] = field(default_factory=set)  # those without a tooltip
    texts: set[str] = field(default_factory=set)  # of everything that was written
    _open: tuple[str, str] | None = None

    def begins(self, control: tuple[str, str]) -> None:
        self.ends()
        self._open = control
        self.controls.add(control)

    def tipped(self) -> None:
        self._open = None

    def ends(self) -> None:
        if self._open is not None:
            self.bare.add(self._open)
        self._open = None


@contextmanager
def noticed(monkeypatch: pytest.MonkeyPatch) -> Iterator[Seen]:
    """Notice all controls: whatever function of Dear ImGui leaves an item with another number has shown one."""
    seen, number = Seen(), imgui.get_item_id

    def watched(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*words: Any, **named: Any) -> Any:
            before = number()
            found = function(*words, **named)
            if number() != before or not number():
                if number() and name not in FRAMES:
                    seen.begins((name, str(words[0]) if words else ""))
                elif name in FRAMES or not number():
                    seen.ends()
            seen.texts.update(each for each in words if isinstance(each, str))
            return found

        return call

    def tip(*words: Any) -> None:
        assert words[0], "a tooltip says something"
        seen.texts.add(str(words[0]))
        seen.tipped()

    with monkeypatch.context() as patch:
        for name in dir(imgui):
            function = getattr(imgui, name)
            if name[0].islower() and callable(function) and not name.startswith(NEUTRAL):
                patch.setattr(imgui, name, watched(name, function))
        patch.setattr(imgui, "set_item_tooltip", tip)
        yield seen
        seen.ends()


@contextmanager
def headless(scale: float = 1.0) -> Iterator[None]:
    """Dear ImGui without a window."""
    context, plots = imgui.create_context(), implot.create_context()
    io = imgui.get_io()
    io.set_ini_filename("")
    io.display_size = imgui.ImVec2(*SIZE)
    io.delta_time = 1 / 60
    io.backend_flags |= imgui.BackendFlags_.renderer_has_textures.value
    _apply_style(scale)
    try:
        yield
    finally:
        implot.destroy_context(plots)
        imgui.destroy_context(context)


class StillDirector:
    """Director of a picture that is there."""

    def __init__(self) -> None:
        pixels = np.zeros((40, 60, 3), np.uint8)
        metadata = {
            "slabs": 12,
            "modelled": ["light"],
            "estimated_error": 1e-3,
            "reached": True,
            "wanted_error": 1 / 255,
        }
        self.shown = Shown(pixels, 1, "rest", metadata)
        self.faults: list[str] = []
        self.why_not_final = ""
        self.pace, self.max_error, self.slicing = Pace(), 1 / 255, "stacks"
        self.accuracy = {"max_error": 1 / 255}
        self.pictures, self.refined, self.refining, self.at_rest = 1, 0.0, False, True
        self.version = 1

    def again(self) -> None:
        """Refine nothing."""


class NoTarget:
    """Framebuffer that is none."""

    def clear(self, *color: float, viewport: tuple[int, int, int, int]) -> None:
        assert min(color) >= 0 and min(viewport[2:]) >= 0


class NoTextures:
    """Textures that are none."""

    gl = SimpleNamespace(viewport=(0, 0, *SIZE))
    target = NoTarget()

    def get(self, name: str, key: Any, make: Callable[[], Any], *, nearest: bool = False) -> int:
        assert make() is not None
        return 1


class NoDrawing:
    """Drawing of pictures into no framebuffer."""

    def draw(self, *_: Any) -> None:
        """Draw nothing."""


def desk_of_noise(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Desk:
    """A dressed desk with a volume of noise open, in a folder that has its state as well."""
    monkeypatch.setenv("XDG_STATE_HOME", str(folder / "state"))
    monkeypatch.chdir(folder)
    np.save("one.npy", np.random.default_rng(3).random((6, 7, 8)).astype(np.float32))
    return dressed(desk_with("one.npy"))


def dressed(desk: Desk) -> Desk:
    """A desk with all that panels ask for."""
    desk.director, desk.textures = cast(Any, StillDirector()), cast(Any, NoTextures())
    desk.viewport, desk.annotating = Viewport(0, 0, SIZE[0] - 360, SIZE[1]), cast(Any, NoDrawing())
    return desk


def shown(desk: Desk, tab: str, frames: int = 4) -> None:
    """Show some frames with that tab open; its layout takes two."""
    for number in range(frames):
        desk.preferences.tab = tab if number == 0 else ""
        imgui.new_frame()
        panels.show(desk)
        panels.picture(desk)
        imgui.end_frame()
