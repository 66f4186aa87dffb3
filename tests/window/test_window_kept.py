"""Width of the panels, size of the picture, layout and switches are the same in the next window."""

from __future__ import annotations

import argparse
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.windows import PATIENCE, display, environment, started, until  # noqa: F401 (display is a fixture)

from texvol.cli import view
from texvol.window import kept
from texvol.window.desk import PANEL_WIDTH
from texvol.window.layout import Layout
from texvol.window.moving import Moving
from texvol.window.plan import Plan


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path


def test_a_width_is_kept(folder: Path) -> None:
    assert kept.panel_width() == PANEL_WIDTH
    kept.keep(PANEL_WIDTH)
    assert not kept.state_file().exists(), "nothing was changed"
    kept.keep(412.5)
    assert kept.panel_width() == 412.5
    assert kept.state_file().is_relative_to(folder)


def test_a_size_is_kept_beside_the_width() -> None:
    assert kept.picture_size() is None
    kept.keep(PANEL_WIDTH, (700, 500))
    assert kept.picture_size() == (700, 500) and kept.panel_width() == PANEL_WIDTH
    kept.keep(400.0)
    assert kept.picture_size() == (700, 500) and kept.panel_width() == 400.0
    kept.keep(400.0, (20, 500))
    assert kept.picture_size() == (700, 500), "a window as small as that is no choice"


def test_the_next_window_has_the_size_of_the_last_one(display: str, tmp_path: Path) -> None:  # noqa: F811
    if not shutil.which("xdotool"):
        pytest.skip("xdotool is not installed")

    def does(*words: str) -> str:
        done = subprocess.run(
            ["xdotool", *words], env=environment(display, tmp_path), check=True, timeout=PATIENCE,
            stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        return done.stdout.split()[-1] if done.stdout.strip() else ""

    np.save(tmp_path / "ball.npy", np.zeros((4, 4, 4), np.uint8))

    def opened(then: Callable[[str], None]) -> None:
        process = started(display, tmp_path, "ball.npy")
        # A title with the name is shown by the main loop, which has measured the size at the beginning by then.
        then(does("search", "--sync", "--onlyvisible", "--name", "ball"))
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE)

    def resized(window: str) -> None:
        does("windowsize", "--sync", window, "900", "410")
        time.sleep(1.0)
        does("windowfocus", window, "key", "ctrl+q")
        until((tmp_path / "state/texvol/window.json").exists)

    opened(resized)
    geometry = []
    opened(lambda window: geometry.append(does("getwindowgeometry", window)))
    assert geometry == ["900x410"]


def test_a_window_that_fills_a_scaled_monitor_shows_its_foot(display: str, tmp_path: Path) -> None:  # noqa: F811
    if missing := [each for each in ("xdotool", "xprop", "xrdb", "openbox") if not shutil.which(each)]:
        pytest.skip(f"{', '.join(missing)} not installed")
    surroundings = environment(display, tmp_path)

    def told(*words: str) -> str:
        return subprocess.check_output(words, env=surroundings, timeout=PATIENCE, text=True)

    with subprocess.Popen(["openbox"], env=surroundings, stderr=subprocess.DEVNULL) as manager:
        try:
            until(lambda: "window id" in told("xprop", "-root", "_NET_SUPPORTING_WM_CHECK"))
            subprocess.run(["xrdb", "-merge"], input="Xft.dpi: 192\n", text=True, env=surroundings, check=True)
            started(display, tmp_path)
            window = told("xdotool", "search", "--sync", "--onlyvisible", "--name", "texvol").split()[-1]
            until(lambda: int(told("xdotool", "getwindowgeometry", window).rpartition("x")[2]) > 900)  # it was 720
            frame = [int(each) for each in re.findall(r"\d+", told("xprop", "-id", window, "_NET_FRAME_EXTENTS"))]
            width, height = map(int, told("xdotool", "getwindowgeometry", window).split()[-1].split("x"))
        finally:
            subprocess.run(["xrdb", "-remove"], env=surroundings, check=True)
            manager.terminate()
    left, right, top, bottom = frame
    assert top > 0
    assert (width + left + right, height + top + bottom) == (1280, 1024)


@pytest.mark.parametrize("size", ["[1]", "[0, 500]", "[1e9, 500]", '["a", "b"]', "[700, 500, 3]", "7", "[true, 500]"])
def test_a_damaged_size_is_as_none(size: str) -> None:
    kept.keep(412.5)
    kept.state_file().write_text('{"picture-size": ' + size + "}")
    assert kept.picture_size() is None


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"panel-width": "wide"}', '{"panel-width": 1e9}', "\0"])
def test_a_damaged_file_is_as_none(text: str) -> None:
    kept.keep(412.5)
    kept.state_file().write_text(text)
    assert kept.panel_width() == PANEL_WIDTH


def test_a_folder_that_can_not_be_written_is_no_fault(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(folder / "file"))
    kept.keep(412.5)
    assert kept.panel_width() == PANEL_WIDTH


def a_desk() -> Any:
    return SimpleNamespace(layout=Layout(), moving=Moving())


def test_the_layout_and_the_switches_of_the_view_are_kept() -> None:
    desk = a_desk()
    desk.layout.become("coronal")
    desk.layout.planes, desk.layout.pictures, desk.moving.cube = False, True, False
    kept.keep(PANEL_WIDTH, None, kept.views_of(desk))
    later = a_desk()
    assert kept.views_of(later) != kept.views_of(desk)
    kept.restore_views(later)
    assert kept.views_of(later) == kept.views_of(desk)
    assert later.layout.shown and later.layout.large == "coronal" and not later.moving.cube


@pytest.mark.parametrize(
    "damaged", ['"slices": 1', '"large-view": "oblique"', '"large-view": []', '"orientation-cube": "no"']
)
def test_damaged_switches_are_as_none(damaged: str) -> None:
    kept.keep(412.5)
    kept.state_file().write_text("{" + damaged + ', "outlines-in-3d": false}')
    desk = a_desk()
    usual = kept.views_of(desk)
    kept.restore_views(desk)
    assert kept.views_of(desk) == usual | {"outlines-in-3d": False}


@pytest.mark.parametrize("words, usual", [([], True), (["--size", "300x200"], False)])
def test_a_size_that_nobody_chose_is_larger_on_a_scaled_monitor(words: list[str], usual: bool) -> None:
    parser = argparse.ArgumentParser()
    view.add_view(parser.add_subparsers())

    def planned(*more: str) -> Plan:
        plan: Plan = view._plan(parser.parse_args(["view", *words, *more]), lambda: None)
        return plan

    width, height = planned().size
    assert planned().window_size(360) == (width + 360, height) == planned().window_size(360, 1.0)
    factor = 2 if usual else 1
    assert planned().window_size(360, 2.0) == (factor * width + 720, factor * height)
    assert planned("--no-panels").window_size(360, 2.0) == (factor * width, factor * height)
    kept.keep(PANEL_WIDTH, (700, 500))
    assert planned().window_size(360, 2.0) == ((1420, 500) if usual else (1020, 200)), "what was kept has its pixels"
