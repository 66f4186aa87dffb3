"""Dialog of the question that waits for an answer; it keeps all input from the picture."""

from __future__ import annotations

from collections.abc import Sequence

from imgui_bundle import imgui

from texvol.window.desk import Desk
from texvol.window.panels import parts

_WIDTH = 380.0  # least one of a question, in window coordinates at scale 1
_NAME = "###question"
_CHOSEN, _OTHER = imgui.ImVec4(0.24, 0.42, 0.64, 1.0), imgui.ImVec4(0.22, 0.25, 0.29, 1.0)


def ask(desk: Desk) -> None:
    """Show the question that waits for an answer, in front of everything else."""
    question = desk.question
    if question is None:
        parts.close_dialog(_NAME)
        return
    if not imgui.is_popup_open(_NAME):
        imgui.open_popup(_NAME)
    middle = imgui.get_io().display_size * 0.5
    imgui.set_next_window_pos(middle, imgui.Cond_.always.value, imgui.ImVec2(0.5, 0.5))
    width = min(max(_WIDTH * parts.scale(), _widest(question.words)), 2 * middle.x - 40)
    imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0), imgui.ImVec2(width, 2 * middle.y))
    flags = imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_title_bar | imgui.WindowFlags_.no_move
    if not imgui.begin_popup_modal(_NAME, None, flags)[0]:
        return
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(question.text)
    for note in filter(None, question.notes):
        imgui.text_disabled(note)
    imgui.pop_text_wrap_pos()
    imgui.spacing()
    pressed = [words for number, words in enumerate(question.words) if _answer(words, number == question.chosen)]
    if pressed:
        desk.reply(pressed[0])
    if desk.question is not question:
        imgui.close_current_popup()
    imgui.end_popup()


def _widest(answers: Sequence[str]) -> float:
    """Return the width of a question in which the longest answer fits."""
    style = imgui.get_style()
    around = 2 * (style.window_padding.x + style.frame_padding.x)
    return max(float(imgui.calc_text_size(words).x) for words in answers) + around


def _answer(words: str, is_chosen: bool) -> bool:
    """Show the button of an answer, marked if Enter gives it; return True if it is pressed."""
    shown = parts.fitting(words, imgui.get_content_region_avail().x - 2 * imgui.get_style().frame_padding.x)
    imgui.push_style_color(imgui.Col_.button.value, _CHOSEN if is_chosen else _OTHER)
    pressed = imgui.button(words if shown == words else f"{shown}###{words}", imgui.ImVec2(-1, 0))
    imgui.pop_style_color()
    if shown != words:
        imgui.set_item_tooltip(words)
    return bool(pressed)
