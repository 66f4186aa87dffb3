"""ctrl-c copies the picture; what other programs paste is what the window shows."""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.desks import done, said
from support.panel_frames import desk_of_noise
from support.windows import PATIENCE, ball, display, eight_bits, environment, started, until  # noqa: F401 (a fixture)

from texvol.formats.pictures import image
from texvol.window import copying
from texvol.window.desk import Desk

needs_tools = pytest.mark.skipif(
    not (shutil.which("xclip") and shutil.which("xdotool")), reason="xclip or xdotool is not installed"
)


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Desk:
    """A desk with a picture of random colours."""
    return desk_of_noise(tmp_path, monkeypatch)


def program(folder: Path, text: str) -> None:
    """Put a program in place of xclip, on an X display."""
    path = folder / "bin" / "xclip"
    path.parent.mkdir()
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)


@pytest.fixture(autouse=True)
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A session of X11, in which only programs of the test are found in the folder `bin`."""
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", ":99")


def copied(desk: Desk) -> str:
    """Last message of the window."""
    end = time.monotonic() + PATIENCE
    while not said(desk):
        assert time.monotonic() < end, "it never said anything"
        copying.update(desk)
        time.sleep(0.01)
    return said(desk)


def test_the_program_gets_a_png_of_the_picture(desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program(tmp_path, f"cat > {tmp_path}/pasted.png; echo $* > {tmp_path}/words")
    monkeypatch.setenv("PATH", f"{tmp_path}/bin:{os.environ['PATH']}")
    desk.director.shown.pixels[:] = np.random.default_rng(1).integers(0, 256, (40, 60, 3))  # type: ignore[union-attr]
    done(desk, "copy")
    assert copied(desk) == "copied the picture, 60 x 40 pixels"
    pasted = np.rint(255 * image.read(tmp_path / "pasted.png"))
    assert (pasted == desk.director.shown.pixels).all()  # type: ignore[union-attr]
    assert (tmp_path / "words").read_text() == "-selection clipboard -t image/png -i\n"


def test_what_is_measured_is_in_the_copied_picture(desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program(tmp_path, f"cat > {tmp_path}/pasted.png")
    monkeypatch.setenv("PATH", f"{tmp_path}/bin:{os.environ['PATH']}")
    done(desk, "measure ruler 0,0,0 6,5,4", "copy")
    assert copied(desk).endswith("copied the picture, 60 x 40 pixels")
    pasted = eight_bits(tmp_path / "pasted.png")
    assert 20 < (pasted.max(axis=2) > 100).sum() < 600, "a line and a number, over a black picture"


def test_without_a_program_the_message_says_what_to_install(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    done(desk, "copy")
    assert "needs the program xclip (package xclip)" in said(desk) and desk.messages[-1].is_fault
    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-0")
    done(desk, "copy")
    assert "needs the program wl-copy (package wl-clipboard)" in said(desk)
    assert not desk.clipboard.wanted


def test_a_program_that_fails_is_named(desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program(tmp_path, "exit 3")
    monkeypatch.setenv("PATH", f"{tmp_path}/bin:{os.environ['PATH']}")
    done(desk, "copy")
    assert copied(desk) == "the picture was not copied: xclip ended with status 3"


def test_a_coarse_picture_is_not_copied_before_it_is_fine(
    desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program(tmp_path, "cat > /dev/null")
    monkeypatch.setenv("PATH", f"{tmp_path}/bin:{os.environ['PATH']}")
    fine = desk.director.shown
    assert fine is not None
    desk.director.shown = replace(fine, state="moving")
    done(desk, "copy")
    copying.update(desk)
    assert desk.clipboard.wanted and not said(desk)
    desk.director.shown = replace(fine, state="refining")
    desk.director.at_rest = False  # type: ignore[misc]
    assert copied(desk) == "copied the picture, 60 x 40 pixels; it was not final yet"


@needs_tools
def test_what_is_pasted_is_the_picture(display: str, tmp_path: Path) -> None:  # noqa: F811
    words = ["--size", "200x160", "--no-panels", "--max-error", "0.1", "--light", "none"]
    process = started(display, tmp_path, ball(tmp_path, 24), *words)

    def does(*words: str) -> bytes:
        return subprocess.run(
            words, env=environment(display, tmp_path), check=True, timeout=PATIENCE, stdout=subprocess.PIPE
        ).stdout

    does("xdotool", "search", "--sync", "--onlyvisible", "--name", "ball")
    until((tmp_path / "state/texvol/recent.json").exists)
    time.sleep(1.0)
    does("xdotool", "key", "ctrl+c")
    kinds = ("xclip", "-selection", "clipboard", "-t", "TARGETS", "-o")
    until(lambda: b"image/png" in subprocess.run(kinds, env=environment(display, tmp_path), capture_output=True).stdout)
    (tmp_path / "pasted.png").write_bytes(does("xclip", "-selection", "clipboard", "-t", "image/png", "-o"))
    does("xdotool", "key", "ctrl+q")
    process.communicate(timeout=PATIENCE)
    pasted = eight_bits(tmp_path / "pasted.png")
    assert pasted.shape == (160, 200, 3) and pasted.max() > 100
