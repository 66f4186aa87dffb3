"""Dear ImGui in a window: set-up, input events, drawing, release.

Dear ImGui's own GLFW back end is not used, because it would not receive the events that a script plays back.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import imgui_bundle
import numpy as np
from imgui_bundle import imgui, implot

from texvol.window.events import BUTTONS, Event
from texvol.window.home import Home

FONT_SIZE = 15.0
_TIP_DELAY = 0.15  # seconds until a tooltip is shown
_AWAY = 6.0  # window coordinates at scale 1: the mouse has left the place of a press
_FONT = Path(imgui_bundle.__file__).parent / "assets/fonts/DroidSans.ttf"

# Dear ImGui's names of keys that differ from GLFW's names.
_NAMES = {
    "left": "left_arrow", "right": "right_arrow", "up": "up_arrow", "down": "down_arrow",
    "left_control": "left_ctrl", "right_control": "right_ctrl", "kp_enter": "keypad_enter",
    "kp_add": "keypad_add", "kp_subtract": "keypad_subtract", "kp_decimal": "keypad_decimal",
    **{str(digit): f"_{digit}" for digit in range(10)}, **{f"kp_{digit}": f"keypad{digit}" for digit in range(10)},
}  # fmt: skip


class Interface:
    """Dear ImGui context of one window."""

    def __init__(self, screen: Home) -> None:
        self._screen = screen
        self._context = imgui.create_context()
        self._plots = implot.create_context()
        io = imgui.get_io()
        io.set_ini_filename("")  # do not write imgui.ini
        io.set_log_filename("")
        io.mouse_double_click_time = 0.45  # seconds: each press is a frame of its own, and frames may be slow
        io.config_input_trickle_event_queue = False  # `Queue.take` divides events among frames, and more finely
        io.backend_flags |= imgui.BackendFlags_.has_mouse_cursors.value
        self._drawing = screen.drawing() or _OwnDrawing()
        platform = imgui.get_platform_io()
        platform.platform_get_clipboard_text_fn = lambda _: screen.clipboard
        platform.platform_set_clipboard_text_fn = lambda _, text: screen.copy(text)
        if _FONT.exists():
            io.fonts.add_font_from_file_ttf(str(_FONT), FONT_SIZE)
        self.scale = 0.0
        self._pressed: tuple[float, float] | None = None  # where the mouse was pressed and stays
        self._before = screen.time

    def begin(self, events: Sequence[Event], late: float = 0.0) -> None:
        """Begin a frame with the events since the last frame, which came `late` seconds ago."""
        io, screen = imgui.get_io(), self._screen
        if screen.scale != self.scale:
            self.scale = screen.scale
            _apply_style(self.scale)
        size, pixels = screen.size, screen.pixels
        io.display_size = imgui.ImVec2(*size)
        if size[0] and size[1]:
            io.display_framebuffer_scale = imgui.ImVec2(pixels[0] / size[0], pixels[1] / size[1])
        io.delta_time = max(screen.time - late - self._before, 1e-4)
        self._before += io.delta_time
        for event in events:
            _feed(io, event)
            self._hush(event)
        self._drawing.begin()
        imgui.new_frame()

    def _hush(self, event: Event) -> None:
        """Show no tooltip after a press until the mouse has moved away: it would cover what has been switched on."""
        if event.kind == "button" and event.down:
            position = imgui.get_io().mouse_pos
            self._pressed = (position.x, position.y)
        elif event.kind == "move" and self._pressed is not None:
            x, y = self._pressed
            if np.hypot(event.x - x, event.y - y) > _AWAY * self.scale:
                self._pressed = None
        imgui.get_style().hover_delay_short = _TIP_DELAY if self._pressed is None else np.inf

    def end(self) -> None:
        """Draw the frame."""
        self._screen.cursor(str(imgui.MouseCursor_(imgui.get_mouse_cursor()).name))
        imgui.render()
        self._drawing.draw(imgui.get_draw_data())

    def close(self) -> None:
        """Release the context; call it while the screen's OpenGL context exists."""
        platform = imgui.get_platform_io()
        platform.platform_get_clipboard_text_fn = platform.platform_set_clipboard_text_fn = None
        self._drawing.close()
        implot.destroy_context(self._plots)
        imgui.destroy_context(self._context)


class _OwnDrawing:
    """Dear ImGui's own renderer, which draws into the window."""

    def __init__(self) -> None:
        imgui.backends.opengl3_init("#version 330")

    def begin(self) -> None:
        imgui.backends.opengl3_new_frame()

    def draw(self, data: Any) -> None:
        imgui.backends.opengl3_render_draw_data(data)

    def close(self) -> None:
        imgui.backends.opengl3_shutdown()


def _feed(io: Any, event: Event) -> None:
    if event.kind in ("key", "button", "scroll"):
        for name, key in (("ctrl", imgui.Key.mod_ctrl), ("shift", imgui.Key.mod_shift), ("alt", imgui.Key.mod_alt)):
            io.add_key_event(key, name in event.modifiers)
    if event.kind == "move":
        io.add_mouse_pos_event(event.x, event.y)
    elif event.kind == "button":
        io.add_mouse_button_event(BUTTONS.index(event.name), event.down)
    elif event.kind == "scroll":
        io.add_mouse_wheel_event(event.x, event.y)
    elif event.kind == "key":
        known: Any = getattr(imgui.Key, _NAMES.get(event.name, event.name), None)
        if known is not None:
            io.add_key_event(known, event.down)
    elif event.kind == "text":
        io.add_input_characters_utf8(event.name)
    elif event.kind == "focus":
        io.add_focus_event(event.down)


_COLORS = {
    "text": (0.92, 0.93, 0.94, 1.0),
    "text_disabled": (0.58, 0.60, 0.63, 1.0),
    "window_bg": (0.105, 0.11, 0.12, 1.0),
    "popup_bg": (0.13, 0.135, 0.15, 0.98),
    "border": (0.25, 0.26, 0.28, 1.0),
    "frame_bg": (0.18, 0.19, 0.21, 1.0),
    "frame_bg_hovered": (0.24, 0.26, 0.29, 1.0),
    "frame_bg_active": (0.28, 0.31, 0.35, 1.0),
    "button": (0.22, 0.25, 0.29, 1.0),
    "button_hovered": (0.28, 0.34, 0.42, 1.0),
    "button_active": (0.25, 0.44, 0.66, 1.0),
    "header": (0.22, 0.36, 0.54, 1.0),
    "header_hovered": (0.26, 0.32, 0.40, 1.0),
    "header_active": (0.25, 0.44, 0.66, 1.0),
    "check_mark": (0.45, 0.72, 1.0, 1.0),
    "slider_grab": (0.22, 0.39, 0.60, 1.0),
    "slider_grab_active": (0.28, 0.50, 0.76, 1.0),
    "tab": (0.16, 0.18, 0.20, 1.0),
    "tab_hovered": (0.28, 0.38, 0.50, 1.0),
    "tab_selected": (0.23, 0.33, 0.45, 1.0),
    "plot_histogram": (0.28, 0.50, 0.76, 1.0),
    "title_bg_active": (0.16, 0.20, 0.25, 1.0),
    "modal_window_dim_bg": (0.0, 0.0, 0.0, 0.45),
}


def _apply_style(scale: float) -> None:
    style = imgui.get_style()
    for name, color in _COLORS.items():
        style.set_color_(getattr(imgui.Col_, name).value, imgui.ImVec4(*color))
    style.font_size_base, style.font_scale_dpi = FONT_SIZE, scale
    style.window_border_size, style.frame_border_size = 0.0, 0.0
    for name in ("window_rounding", "frame_rounding", "popup_rounding", "grab_rounding", "tab_rounding"):
        setattr(style, name, 4.0 * scale)
    style.window_padding = imgui.ImVec2(12 * scale, 10 * scale)
    style.frame_padding = imgui.ImVec2(8 * scale, 4 * scale)
    style.item_spacing = imgui.ImVec2(8 * scale, 6 * scale)
    style.item_inner_spacing = imgui.ImVec2(6 * scale, 4 * scale)
    style.cell_padding = imgui.ImVec2(4 * scale, 2 * scale)
    style.separator_text_padding = imgui.ImVec2(20 * scale, 3 * scale)
    style.separator_text_border_size, style.indent_spacing = 3 * scale, 20 * scale
    style.grab_min_size = 12 * scale
    style.scrollbar_size = 12 * scale
