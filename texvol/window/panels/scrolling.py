"""Scrolling by a drag, for screens that are touched: on empty ground by one finger, anywhere by two.

One finger is the left button, two are the middle one, see page/view.js.
"""

from __future__ import annotations

from typing import Any

from imgui_bundle import imgui

_LEFT, _MIDDLE = 0, 2
_DRAGGED = "scrolled by a drag"  # key of the window's number


def drag(state: dict[str, Any]) -> None:
    """Scroll the window under a drag; call it after all windows of a frame were shown."""
    on_ground = imgui.is_mouse_clicked(_LEFT) and not imgui.is_any_item_hovered()
    if on_ground or imgui.is_mouse_clicked(_MIDDLE):
        state[_DRAGGED] = _scrolling()
    if not imgui.is_mouse_down(_LEFT) and not imgui.is_mouse_down(_MIDDLE):
        state.pop(_DRAGGED, None)
    window = imgui.internal.find_window_by_id(state[_DRAGGED]) if state.get(_DRAGGED) else None
    if window is not None:
        imgui.internal.set_scroll_y(window, window.scroll.y - imgui.get_io().mouse_delta.y)


def _scrolling() -> int | None:
    """Return the number of the innermost window under the mouse that has something to scroll."""
    window: imgui.internal.Window | None = imgui.get_current_context().hovered_window
    while window is not None and window.scroll_max.y <= 0:
        window = window.parent_window if window.flags & imgui.WindowFlags_.child_window else None
    return None if window is None else int(window.id_)
