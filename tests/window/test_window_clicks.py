"""Clicks of a real mouse: each one is heard, also if it comes at the same time as the move before it."""

from __future__ import annotations

import itertools
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support.windows import PATIENCE, display, environment, until  # noqa: F401 (display is a fixture)

from texvol.window.events import Event, Queue

# A window whose selected tab is written to a file in each frame.
_WINDOW = """
from pathlib import Path
from texvol.window import application, panels

def told(desk, show=panels.show):
    show(desk)
    Path("tab").write_text(desk.panel_state.get("tab", ""))
    if "Medium" in desk.panel_state.get("tab", ""):
        Path("begun").touch()

panels.show = told
with application.Application(application.Plan((400, 300))) as window:
    window.run()
"""
CLICKS = 30


@pytest.mark.slow
def test_tabs_hear_every_click(display: str, tmp_path: Path) -> None:  # noqa: F811
    if not shutil.which("xdotool"):
        pytest.skip("xdotool is not installed")
    environ = environment(display, tmp_path)
    process = subprocess.Popen([sys.executable, "-c", _WINDOW], cwd=tmp_path, env=environ)

    def does(*words: str) -> None:
        subprocess.run(["xdotool", *words], env=environ, check=True, timeout=PATIENCE)

    def selected() -> str:
        return (tmp_path / "tab").read_text()

    try:
        does("search", "--sync", "--onlyvisible", "--name", "texvol")
        until((tmp_path / "begun").exists)
        # The tabs stand in a row from the panel's left edge on: Medium, Scene.
        for x, name in itertools.islice(itertools.cycle(((495, "Scene"), (435, "Medium"))), CLICKS):
            does("mousemove", str(x), "24", "click", "1")
            until(lambda name=name: selected() == name)
    finally:
        process.kill()
        process.wait()


# A window with slow frames, in which panels of another width get the usual one by a double click on their edge.
_SLOW = """
import time
from texvol.window import application, panels
from texvol.window.events import Event
from texvol.window.script import Player, Step

widths = []

def slow(desk, show=panels.show):
    if not widths:
        desk.preferences.width = 300
    show(desk)
    widths.append(desk.preferences.width)
    time.sleep(0.3)

panels.show = slow
clicks = [Step(T + APART * n, Event("button", name="left", down=n % 2 == 0)) for n in range(4)]
steps = [Step(0.5, Event("move", 463, 150)), *clicks]
with application.Application(application.Plan((400, 300), player=Player(steps))) as window:
    while len(widths) < 14:
        window.frame()
print(round(widths[0]), round(widths[-1]))
"""


@pytest.mark.parametrize(("apart", "width"), [(0.05, 360), (0.4, 300)])
def test_slow_frames_do_not_take_a_double_click_apart_nor_make_one(
    display: str,  # noqa: F811
    tmp_path: Path,
    apart: float,
    width: int,
) -> None:
    code = _SLOW.replace("T + APART", f"1.3 + {apart}")
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment(display, tmp_path),
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )
    assert (done.stdout.split(), done.stderr) == (["300", str(width)], "")


def taken(*events: Event) -> list[list[Event]]:
    """Events of each frame."""
    queue = Queue()
    for event in events:
        queue.put(event)
    frames = []
    while queue:
        frames.append(queue.take())
    return frames


MOVE, PRESS, RELEASE = Event("move", 3, 4), Event("button", name="left", down=True), Event("button", name="left")


def test_a_click_is_a_frame_after_its_move_and_before_the_next() -> None:
    assert taken(MOVE, PRESS, RELEASE, MOVE) == [[MOVE], [PRESS], [RELEASE], [MOVE]]


def test_a_turn_of_the_wheel_has_its_modifiers() -> None:
    up, plain = Event("key", name="left_control"), Event("scroll", y=1)
    held = Event("scroll", y=1, modifiers=("ctrl",))
    assert taken(held, held, up, plain, plain) == [[held, held], [up, plain, plain]]
    assert taken(plain, held) == [[plain], [held]]


def test_letters_that_are_typed_fast_are_one_frame() -> None:
    typed = [
        each
        for name in "abba"
        for each in (Event("key", name=name, down=True), Event("text", name=name), Event("key", name=name))
    ]
    assert taken(*typed) == [typed]


@pytest.mark.parametrize("name", ["enter", "tab", "backspace", "left"])
def test_what_is_typed_before_and_after_a_key_that_edits_is_apart_from_it(name: str) -> None:
    letter, down, up = Event("text", name="a"), Event("key", name=name, down=True), Event("key", name=name)
    assert taken(letter, down, up, letter) == [[letter], [down], [up], [letter]]
    with_ctrl = Event("key", name="a", down=True, modifiers=("ctrl",))
    assert taken(letter, with_ctrl, letter) == [[letter], [with_ctrl], [letter]]


def test_a_chord_is_a_frame_before_its_keys_are_released_in_either_order() -> None:
    ctrl, press = Event("key", name="left_control", down=True), Event("key", name="a", down=True, modifiers=("ctrl",))
    ctrl_up, up = Event("key", name="left_control", modifiers=("ctrl",)), Event("key", name="a")
    assert taken(ctrl, press, ctrl_up, up) == [[ctrl, press], [ctrl_up, up]]
    assert taken(press, ctrl_up, up) == [[press], [ctrl_up, up]]
    held_up, late_up = Event("key", name="a", modifiers=("ctrl",)), Event("key", name="left_control")
    assert taken(ctrl, press, held_up, late_up) == [[ctrl, press], [held_up, late_up]]


def test_what_comes_late_is_told() -> None:
    queue = Queue()
    press, release = (Event("button", name="left", down=down) for down in (True, False))
    queue.append(press, 7.0)
    queue.append(release, 6.0)
    assert queue.take() == [press] and 7.0 <= queue.late < 7.0 + PATIENCE
    assert queue.take() == [release] and 6.0 <= queue.late < 6.0 + PATIENCE
    assert queue.take() == [] and queue.late == 0.0


def test_a_script_is_played_back_with_every_move() -> None:
    queue = Queue()
    for x in range(3):
        queue.append(Event("move", x, 0))
    assert [event.x for event in queue.take()] == [0, 1, 2]
