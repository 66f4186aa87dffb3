"""Looking for files: what is listed, what a choice does, and that the window draws on meanwhile."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Any

import pytest
from support.windows import PATIENCE, ball, display, eight_bits, script, viewed  # noqa: F401 (display is a fixture)

from texvol.window.browsing import Browser, Entry, Listing


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Files and folders of several kinds."""
    for name in ("b.nrrd", "A.npy", ".hidden"):
        (tmp_path / name).write_text("")
    (tmp_path / "Series/deeper").mkdir(parents=True)
    (tmp_path / "all").mkdir()
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "nowhere").symlink_to("gone")
    return tmp_path


def browser(folder: Path, **more: Any) -> tuple[Browser, list[str]]:
    """One that looks there, and what it was told to take."""
    taken: list[str] = []
    return listed(Browser("open", taken.append, lambda: None, folder, **more)), taken


def listed(looking: Browser) -> Browser:
    """The same, once it knows what is there."""
    end = time.monotonic() + PATIENCE
    while looking.listing.entries is None:
        assert time.monotonic() < end, "the folder was never read"
        time.sleep(0.01)
    return looking


def test_folders_come_first_and_what_can_not_be_opened_not_at_all(folder: Path) -> None:
    listing = Listing(folder)
    listing.read()
    expected = [Entry("all", True), Entry("Series", True), Entry("A.npy", False), Entry("b.nrrd", False)]
    assert (listing.entries, listing.fault) == (expected, "")


def test_a_folder_that_can_not_be_read_says_so(folder: Path) -> None:
    listing = Listing(folder / "gone")
    listing.read()
    assert listing.entries == [] and "gone: No such file" in listing.fault


def test_entries_lead_into_folders_and_to_files(folder: Path) -> None:
    looking, taken = browser(folder)
    looking.pick(Entry("Series", True))
    assert listed(looking).folder == folder / "Series" and not looking.over and not taken
    looking.enter("..")
    assert listed(looking).folder == folder
    looking.enter("none.npy")
    assert "none.npy: file not found" in looking.listing.fault and not looking.over
    looking.pick(Entry("A.npy", False))
    assert looking.over and taken == [str(folder / "A.npy")]


def test_a_place_to_write_need_not_be_there_and_what_is_there_is_said(folder: Path) -> None:
    looking, taken = browser(folder, saves=True, name="new.toml")
    assert not looking.replaces
    looking.name = "b.nrrd"
    assert looking.replaces
    looking.enter("Series/other.png")
    assert listed(looking).folder == folder / "Series" and looking.name == "other.png" and not looking.over
    looking.accept()
    assert looking.over and taken == [str(folder / "Series/other.png")]


def test_a_file_is_found_by_mouse_and_opened(display: str, tmp_path: Path) -> None:  # noqa: F811
    (tmp_path / "aside").mkdir()
    ball(tmp_path / "aside", 16)

    def click(t: float, x: float, y: float) -> list[dict[str, Any]]:
        """Two clicks at a place."""
        steps: list[dict[str, Any]] = [{"t": t, "kind": "move", "x": x, "y": y}]
        for n in range(4):
            steps.append({"t": t + 0.05 + 0.04 * n, "kind": "button", "name": "left", "down": n % 2 == 0})
        return steps

    # The list begins under the title and the folder's name; the first entry is the folder, in it there is one file.
    first = (200.0, 72.0)
    steps = [
        {"t": 0, "do": "rest"},
        {"t": 0.1, "do": "command", "name": "open"},
        {"t": 1.0, "do": "screenshot", "file": "looking.png"},
        *click(1.1, *first),
        {"t": 2.5, "do": "screenshot", "file": "deeper.png"},
        *click(2.6, *first),
        {"t": 3.5, "do": "rest"},
        {"t": 3.6, "do": "save", "file": "found.toml"},
    ]
    words = ["--size", "560x440", "--no-panels", "--max-error", "0.1", "--script", script(tmp_path, steps)]
    done = viewed(display, tmp_path, ball(tmp_path, 24), *words)
    assert (done.returncode, done.stderr) == (0, "")
    looking, deeper = (eight_bits(tmp_path / f"{name}.png") for name in ("looking", "deeper"))
    assert (looking != deeper).any(), "another folder is seen"
    assert f"volume = {json.dumps('aside/ball.npy')}" in (tmp_path / "found.toml").read_text()
