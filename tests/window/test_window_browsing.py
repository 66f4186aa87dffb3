"""Looking for files: what is listed, what a choice does, and that the window draws on meanwhile."""

from __future__ import annotations

import itertools
import json
import os
import time
from pathlib import Path
from typing import Any

import pytest
from imgui_bundle import imgui
from support.panel_frames import desk_of_noise, headless
from support.windows import PATIENCE, ball, display, script, viewed  # noqa: F401 (display is a fixture)

from texvol.util import reach
from texvol.window import recent
from texvol.window.browsing import Browser
from texvol.window.desk import Desk
from texvol.window.events import Event
from texvol.window.interface import _feed
from texvol.window.listing import HERE, Entry, Listing, Order, completed, size_text
from texvol.window.panels.browser import browse


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Files and folders of several kinds."""
    for name in ("b.nrrd", "A.npy", ".hidden", "notes.txt"):
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


def names(entries: list[Entry] | None) -> list[str]:
    return [each.name for each in entries or ()]


def pressed(looking: Browser, *chords: str) -> Browser:
    """The same, after keys."""
    for chord in chords:
        *modifiers, name = chord.split("+")
        looking.hear(Event("key", name=name, down=True, modifiers=tuple(modifiers)))
        looking.hear(Event("key", name=name, modifiers=tuple(modifiers)))
    return listed(looking)


def typed(looking: Browser, text: str) -> Browser:
    """The same, after letters."""
    for letter in text:
        looking.hear(Event("text", name=letter))
    return looking


def test_folders_come_first_then_what_can_be_opened_and_pipes_not_at_all(folder: Path) -> None:
    looking, _ = browser(folder)
    assert names(looking.entries) == ["all", "Series", "A.npy", "b.nrrd", "notes.txt"]
    # A text may hold names of labels.
    assert [each.is_known for each in looking.entries or ()] == [True] * 5
    assert ".hidden" in names(pressed(looking, "ctrl+h").entries)


def test_a_folder_that_can_not_be_read_says_so(folder: Path) -> None:
    listing = Listing(folder / "gone")
    listing.read()
    assert listing.entries == [] and "gone: No such file" in listing.fault


def test_stores_are_files_and_folders_of_slices_can_be_opened(folder: Path) -> None:
    (folder / "big.ome.zarr").mkdir()
    looking, taken = browser(folder)
    store = next(each for each in looking.entries or () if each.name == "big.ome.zarr")
    assert not store.is_folder and store.is_known
    looking.enter("big.ome.zarr")
    assert taken == [str(folder / "big.ome.zarr")] and looking.over
    for number in range(3):
        (folder / f"Series/IM{number}").write_bytes(bytes(128) + b"DICM")
    looking, taken = browser(folder / "Series")
    assert looking.entries and looking.entries[0].what == "DICOM" and looking.name == HERE
    pressed(looking, "enter")
    assert taken == [str(folder / "Series")]


@pytest.mark.parametrize(
    "files, whole_first",
    [
        (["slice_01.tif", "slice_02.tif", "slice_10.tif"], True),
        (["0001.tiff", "0002.tiff", "mask.tif", "notes.txt"], True),
        (["brain.tif", "cells.tif"], False),
        (["cells.ome.tif", "xyzc_16bit_cells.tif"], False),
        (["fly_150x256x256.tif", "fly_75x128x128.tif"], False),
        (["a1.tif", "b1.tif", "a2.tif", "c.tif", "d.tif"], False),
    ],
)
def test_slices_of_a_folder_come_before_its_files_where_their_names_are_numbered(
    folder: Path, files: list[str], whole_first: bool
) -> None:
    for name in files:
        (folder / "all" / name).write_bytes(b"II*\0")
    (folder / "all/in").mkdir()
    looking, _ = browser(folder / "all")
    shown = names(looking.entries)
    known = sorted(name for name in files if name.endswith(("tif", "tiff")))
    others = [name for name in files if name not in known]
    assert shown == ([HERE, "in", *known, *others] if whole_first else ["in", *known, HERE, *others])
    assert looking.name == shown[0]


def test_entries_are_sorted_by_name_size_and_date(folder: Path) -> None:
    for name, size, date in (("c.npy", 5, 100), ("d.npy", 3, 300), ("e.npy", 4, 200)):
        (folder / "all" / name).write_bytes(bytes(size))
        os.utime(folder / "all" / name, (date, date))
    (folder / "all/in").mkdir()
    looking, _ = browser(folder / "all")
    by: list[tuple[Order, bool, str]] = [
        ("name", False, "cde"), ("name", True, "edc"), ("size", False, "dec"), ("size", True, "ced"),
        ("date", False, "ced"), ("date", True, "dec"),
    ]  # fmt: skip
    for order, descending, expected in by:
        looking.order = order, descending
        assert names(looking.entries) == ["in", *(f"{letter}.npy" for letter in expected)]


@pytest.mark.parametrize(
    "size, text", [(-1, ""), (0, "0 B"), (999, "999 B"), (1000, "1 kB"), (123_456, "123 kB"), (99_960_000, "100 MB")]
)
def test_sizes_have_three_digits(size: int, text: str) -> None:
    assert size_text(size) == text


def test_entries_lead_into_folders_and_to_files(folder: Path) -> None:
    looking, taken = browser(folder)
    looking.pick(Entry("Series", True))
    assert listed(looking).folder == folder / "Series" and not looking.over and not taken
    looking.enter("..")
    assert listed(looking).folder == folder
    looking.enter("none.npy")
    assert "none.npy: file not found" in looking.fault and not looking.over
    looking.pick(Entry("A.npy", False))
    assert looking.over and taken == [str(folder / "A.npy")]


def test_the_button_opens_the_typed_path_or_else_the_selected_entry(folder: Path) -> None:
    looking, taken = browser(folder)
    assert looking.entries and looking.name == "all"
    looking.typing("Series/..")
    looking.press()
    assert listed(looking).folder == folder and not looking.text, "a typed folder is listed"
    looking.typing("Series")
    looking.select(Entry("b.nrrd", False))
    looking.press()
    assert taken == [str(folder / "b.nrrd")], "a click after typing counts"
    looking, taken = browser(folder)
    looking.typing(f"{folder}/A.n")
    looking.press()
    assert not taken and looking.fault == looking.listing.fault == "" and looking.folder != folder, (
        "part of a name opens the selection"
    )


def test_what_was_wrong_with_a_path_is_said_until_another_one_is_typed(folder: Path) -> None:
    looking, _ = browser(folder)
    looking.listing.fault = "only 20,000 entries are shown"
    looking.typing("none.npy")
    looking.enter("none.npy")
    looking.typing("none.npy")  # the next frame
    assert "file not found" in looking.fault
    looking.typing("non")
    assert looking.fault == "" and looking.listing.fault == "only 20,000 entries are shown"


def test_keys_move_open_and_leave(folder: Path) -> None:
    looking, taken = browser(folder)
    assert looking.entries and looking.name == "all"
    assert pressed(looking, "down", "down").name == "A.npy"
    assert pressed(looking, "end").name == "notes.txt" and pressed(looking, "down").name == "notes.txt"
    assert pressed(looking, "home").name == "all" and pressed(looking, "page_down").name == "notes.txt"
    assert pressed(looking, "page_up", "down", "enter").folder == folder / "Series" and not taken
    assert pressed(looking, "backspace").folder == folder
    assert looking.entries and looking.name == "Series", "where it came from"
    pressed(looking, "down", "down", "enter")
    assert looking.over and taken == [str(folder / "b.nrrd")]
    looking, taken = browser(folder)
    assert pressed(looking, "escape").over and not taken


def test_letters_select_what_begins_with_them(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [10.0]
    monkeypatch.setattr("texvol.window.browsing.time.monotonic", lambda: now[0])
    looking, _ = browser(folder)
    assert typed(looking, "a").name == "all"
    assert typed(looking, ".").name == "A.npy", "a. is the beginning"
    now[0] += 5
    assert typed(looking, "b").name == "b.nrrd"
    now[0] += 5
    assert typed(looking, "ries").name == "Series", "it need not be the beginning"
    typed(looking, "/")
    assert looking.text == "/" and looking.wants_field
    typed(looking, "usr")
    assert looking.text == "/usr", "letters that come before the field is edited are its text"


def frame(desk: Desk, *events: Event) -> None:
    """Let the dialog hear events in one frame of its window."""
    for event in events:
        _feed(imgui.get_io(), event)
    imgui.new_frame()
    browse(desk)
    desk.hear(events, typing=bool(imgui.get_io().want_text_input))
    imgui.end_frame()


def test_a_path_that_is_typed_fast_is_in_the_field_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Letters may come in any number per frame while "/" leads to the field."""
    desk, path = desk_of_noise(tmp_path, monkeypatch), "/a/a/äb"
    for cuts in itertools.product((False, True), repeat=len(path) - 1):
        looking, _ = browser(tmp_path)
        desk.browser, frames = looking, [path[:1]]
        for letter, cut in zip(path[1:], cuts, strict=True):
            frames = [*frames, letter] if cut else [*frames[:-1], frames[-1] + letter]
        with headless():
            for letters in ("", "", *frames, "", "", ""):
                frame(desk, *(Event("text", name=letter) for letter in letters))
        assert looking.text == path, frames


def test_enter_in_the_field_of_reading_options_opens_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    desk = desk_of_noise(tmp_path, monkeypatch)
    looking, taken = browser(tmp_path, takes_words=True)
    looking.select(Entry("one.npy", False))
    desk.browser, field, places = looking, imgui.input_text_with_hint, []

    def noted(label: str, *how: Any) -> Any:
        found = field(label, *how)
        if label == "##words":
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            places.append(((low.x + high.x) / 2, (low.y + high.y) / 2))
        return found

    monkeypatch.setattr(imgui, "input_text_with_hint", noted)
    with headless():
        for _ in range(4):
            frame(desk)
        frame(desk, Event("move", *places[-1]))
        frame(desk, Event("button", name="left", down=True))
        frame(desk, Event("button", name="left"))
        frame(desk, *(Event("text", name=letter) for letter in "--time 0"))
        frame(desk)
        assert looking.words == "--time 0" and not taken
        frame(desk, Event("key", name="enter", down=True))
        frame(desk, Event("key", name="enter"))
    assert taken == [str(tmp_path / "one.npy")] and looking.words == "--time 0"


def test_a_path_is_completed_as_far_as_names_agree(folder: Path) -> None:
    entries = [Entry(name, name[0] == "S") for name in ("scan-1.npy", "Scan-2.npy", "Series", "ß", ".hidden")]
    assert completed("sc", entries) == "scan-1.npy", "as it is written, if that is possible"
    assert completed("", [Entry("scan-1.npy", False), Entry("Scan-22.npy", False)]) == "scan-"
    assert completed("Se", entries) == "Series/" and completed("../Se", entries) == "../Series/"
    assert completed("x", entries) == "x" and completed(".h", entries) == ".hidden"
    looking, _ = browser(folder)
    (folder / "Series/scan.npy").write_text("")
    looking.typing("Series/")
    end = time.monotonic() + PATIENCE
    while (done := looking.completed("Series/s")) == "Series/s":
        assert time.monotonic() < end, "the folder beside was never read"
        time.sleep(0.01)
    assert done == "Series/scan.npy"
    looking.typing("b")
    assert looking.name == "b.nrrd"


def test_a_place_to_write_need_not_be_there(folder: Path) -> None:
    looking, taken = browser(folder, saves=True, name="new.toml")
    assert looking.text == "new.toml" and looking.wants_field
    looking.enter("gone/other.png")
    assert "file not found" in looking.fault and not looking.over
    looking.enter("Series/other.png")
    assert listed(looking).folder == folder / "Series" and looking.name == "other.png" and not looking.over
    looking.enter("other.png")
    assert looking.over and taken == [str(folder / "Series/other.png")]


def keyed(t: float, name: str) -> list[dict[str, Any]]:
    """A key, down and up."""
    return [{"t": t, "kind": "key", "name": name, "down": True}, {"t": t + 0.02, "kind": "key", "name": name}]


def test_a_file_is_found_by_mouse_and_by_keyboard_and_the_picture_hears_nothing(
    display: str,  # noqa: F811
    tmp_path: Path,
) -> None:
    (tmp_path / "aside").mkdir()
    for folder in (tmp_path, tmp_path / "aside"):
        ball(folder, 16)

    def click(t: float, x: float, y: float) -> list[dict[str, Any]]:
        """Two clicks at a place."""
        steps: list[dict[str, Any]] = [{"t": t, "kind": "move", "x": x, "y": y}]
        for n in range(4):
            steps.append({"t": t + 0.05 + 0.04 * n, "kind": "button", "name": "left", "down": n % 2 == 0})
        return steps

    drag: list[dict[str, Any]] = [
        {"t": 0.4, "kind": "move", "x": 4, "y": 4},
        {"t": 0.45, "kind": "button", "name": "left", "down": True},
        {"t": 0.5, "kind": "move", "x": 5, "y": 300},
        {"t": 0.55, "kind": "button", "name": "left"},
        {"t": 0.6, "kind": "scroll", "y": 3},
    ]
    steps = [
        {"t": 0, "do": "rest"},
        {"t": 0.1, "do": "save", "file": "before.toml"},
        {"t": 0.2, "do": "command", "name": "open"},
        *drag,
        *keyed(0.7, "x"),
        {"t": 0.75, "kind": "text", "name": "x"},
        *keyed(0.8, "f"),
        {"t": 0.9, "do": "save", "file": "meanwhile.toml"},
        # The list begins under title, folder, field and headers; the first entry is the folder, in it is one file.
        *click(1.0, 300.0, 122.0),
        *keyed(2.0, "home"),
        *keyed(2.1, "enter"),
        {"t": 2.5, "do": "rest"},
        {"t": 2.6, "do": "save", "file": "found.toml"},
        {"t": 2.7, "do": "command", "name": "open"},
        *keyed(3.2, "tab"),
        *({"t": 3.3, "kind": "text", "name": letter} for letter in "../ba"),
        *keyed(3.6, "tab"),
        *keyed(3.8, "enter"),
        {"t": 4.2, "do": "rest"},
        {"t": 4.3, "do": "save", "file": "typed.toml"},
    ]
    words = ["--size", "560x440", "--no-panels", "--max-error", "0.1", "--light", "none", "--zoom", "0.2"]
    done = viewed(display, tmp_path, ball(tmp_path, 24), *words, "--script", script(tmp_path, steps))
    assert (done.returncode, done.stderr) == (0, "")
    before, meanwhile, found, typed_path = (
        (tmp_path / f"{name}.toml").read_text() for name in ("before", "meanwhile", "found", "typed")
    )
    assert before.replace("before", "meanwhile") == meanwhile
    assert f"volume = {json.dumps('aside/ball.npy')}" in found
    assert f"volume = {json.dumps('ball.npy')}" in typed_path


def test_folders_out_of_reach_are_not_listed_and_their_files_not_looked_for(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "secret.npy").write_bytes(b"")
    reach.limit([str(tmp_path / "in")])
    try:
        looking, taken = browser(tmp_path / "in")
        for typed in ("../secret.npy", "../nothing.npy", "..", "/etc/passwd"):
            looking.fault = ""
            looking.enter(typed)
            assert "is outside" in looking.fault, "of a file that is there, and of one that is not"
            assert looking.folder == tmp_path / "in"
        for typed in ("x" * 5000, "a/" * 3000, "a\0b", "..%2fsecret.npy", "..\\secret.npy", "file:///etc/passwd"):
            looking.fault = ""
            looking.enter(typed)
            assert looking.fault
        listing = Listing(tmp_path)
        listing.read()
        assert listing.entries == [] and "is outside" in listing.fault
        assert recent.folders()[0] == tmp_path / "in"
        assert all(each.is_relative_to(tmp_path / "in") for each in recent.folders())
        assert not taken
    finally:
        reach.limit(None)
