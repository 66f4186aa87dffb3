"""Time bar below the picture: play and pause, step by step, a slider through all time steps."""

from __future__ import annotations

from imgui_bundle import imgui

from texvol.window import commands
from texvol.window.desk import Desk
from texvol.window.panels import icons, parts, tips
from texvol.window.times import LEAST_PACE, MOST_PACE

_WIDTH, _MARGIN = 620.0, 10.0  # window coordinates at scale 1
_PACE_WIDTH = 52.0
_NARROW = 330.0  # below, only buttons and slider are shown
_ALPHA = 0.85


def room(desk: Desk) -> float:
    """Return the height that the time bar takes with its margins, if it is shown."""
    is_shown = desk.times.has_steps and desk.document is not None
    return _height() + 2 * _MARGIN if is_shown else 0.0


def _height() -> float:
    return imgui.get_frame_height() + 2 * imgui.get_style().window_padding.y


def show(desk: Desk) -> None:
    """Show the time bar below all views, if the scene has several time steps."""
    times, scale, area = desk.times, parts.scale(), desk.layout.area
    if not times.has_steps or desk.document is None:
        return
    width = min(_WIDTH * scale, area.width - 2 * _MARGIN)
    if width < 4 * imgui.get_frame_height():
        return
    height = _height()
    left = area.x + (area.width - width) / 2
    bottom = area.y + area.height + room(desk) - _MARGIN
    imgui.set_next_window_pos(imgui.ImVec2(left, bottom - height))
    imgui.set_next_window_size(imgui.ImVec2(width, height))
    imgui.set_next_window_bg_alpha(_ALPHA)
    flags = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_saved_settings
    imgui.begin("time bar", None, flags | imgui.WindowFlags_.no_focus_on_appearing)
    for name, symbol, command in (
        ("##step back", "back", "step -1"),
        ("##play", "pause" if times.playing else "play", "play"),
        ("##step on", "next", "step +1"),
    ):
        if icons.button(name, symbol):  # type: ignore[arg-type]
            commands.run(desk, command)
        tips.show(name)
        imgui.same_line()
    _slider(desk, narrow=width < _NARROW * scale)
    imgui.end()


def _slider(desk: Desk, *, narrow: bool) -> None:
    """Show the slider, its time, and how many steps per second are played."""
    times, scale = desk.times, parts.scale()
    said = times.time
    spacing = imgui.get_style().item_spacing.x
    right = 0.0
    if not narrow:
        right = imgui.calc_text_size(_longest(said)).x + _PACE_WIDTH * scale + imgui.calc_text_size("steps/s").x
        right += (3 if said else 2) * spacing
    imgui.set_next_item_width(-max(right, 1.0))
    words = f"step %d (0 to {times.count - 1})" if not narrow else "%d"
    changed, wanted = imgui.slider_int("##time step", times.wanted, 0, times.count - 1, words)
    tips.show("##time step")
    if changed:
        times.playing = False
        times.go(min(max(wanted, 0), times.count - 1))
    if narrow:
        return
    if said:
        imgui.same_line()
        x = imgui.get_cursor_pos_x()
        imgui.text_unformatted(said)
        imgui.set_item_tooltip("time of this step, as the file tells it")
        imgui.same_line(x + imgui.calc_text_size(_longest(said)).x)
    imgui.same_line()
    imgui.set_next_item_width(_PACE_WIDTH * scale)
    _, pace = imgui.drag_float("steps/s", times.pace, 0.2, LEAST_PACE, MOST_PACE, "%.3g")
    times.pace = min(max(pace, LEAST_PACE), MOST_PACE)
    played = f"\nplayed now: {times.rate:.1f} per second" if times.playing and times.rate else ""
    imgui.set_item_tooltip(tips.tip("steps/s") + played)


def _longest(said: str) -> str:
    """Return a text at least as wide as any time, so that nothing beside it moves while a film is played."""
    head, _, unit = said.partition(" ")
    return f"{'0' * max(len(head), 6)} {unit}".rstrip() if said else ""
