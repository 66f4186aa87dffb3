"""Every control of every panel has a tooltip, whatever it is shown for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from imgui_bundle import imgui
from support.desks import desk_with, done
from support.panel_frames import Seen, dressed, headless, noticed, shown

from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import Light, Lighting
from texvol.scene.scene import MODES
from texvol.window.browsing import Browser
from texvol.window.commands import TABS
from texvol.window.desk import Desk
from texvol.window.panels import parts, tips
from texvol.window.questions import Question
from texvol.window.slices import NAMES


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A volume, one more, and labels, in the current folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(3)
    for name in ("one", "two"):
        np.save(tmp_path / f"{name}.npy", rng.random((9, 10, 12)).astype(np.float32))
    np.save(tmp_path / "labels.npy", np.repeat(np.arange(4, dtype=np.uint8), 128).reshape(8, 8, 8))
    (tmp_path / "mesh.obj").write_text("v 0 0 0\nv 5 0 0\nv 0 5 0\nf 1 2 3\n")
    return tmp_path


def everything(desk: Desk) -> None:
    """Give the scene a bit of everything that panels have controls for."""
    document = desk.document
    assert document is not None
    lights = Light("directional", (1.0, 0.0, 0.0)), Light("point", (9.0, 0.0, 0.0))
    document.change(
        lighting=Lighting(lights=lights),
        crop=((0.0, 5.0), (0.0, 5.0), (0.0, 5.0)),
        clip=(ClipPlane((1.0, 0.0, 0.0), 3.0),),
    )


# Pictures in which one drags and clicks: a tooltip would cover them, and texts beside them explain their use. The
# sphere has a tooltip for each light on it.
PICTURES = {("invisible_button", name) for name in (*NAMES, "plot", "sphere")}
# The tooltip of a tab that is in front would cover its first controls.
IN_FRONT = {("begin_tab_item", name) for name in TABS}


def bare(seen: Seen) -> str:
    return "\n".join(f"{function} {label!r} has no tooltip" for function, label in sorted(seen.bare))


def check(desk: Desk, monkeypatch: pytest.MonkeyPatch, least: int) -> set[str]:
    """Show all tabs; return what is written in them."""
    with headless(), noticed(monkeypatch) as seen:
        for tab in TABS:
            shown(desk, tab)
    assert len(seen.controls) >= least
    seen.bare -= PICTURES | IN_FRONT
    assert {tips.TIPS[tab] for tab in TABS} <= seen.texts
    assert not seen.bare, bare(seen)
    return seen.texts


@pytest.mark.parametrize("mode", MODES)
def test_every_control_has_a_tooltip_in_each_mode(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    desk = dressed(desk_with("one.npy"))
    everything(desk)
    done(desk, f"mode {mode}")
    desk.preferences.details = True
    check(desk, monkeypatch, 60)


def test_every_control_has_a_tooltip_with_volumes_meshes_masks_and_labels(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = desk_with("one.npy")
    done(desk, "add two.npy", "add mesh.obj", "mask two.npy")
    check(dressed(desk), monkeypatch, 60)
    check(dressed(desk_with("labels.npy")), monkeypatch, 45)


def test_every_control_has_a_tooltip_while_a_file_is_written_and_another_is_chosen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    desk = dressed(desk_with("one.npy"))
    desk.writing, desk.job = 0.4, {"path": "picture.png"}
    with headless(), noticed(monkeypatch) as seen:
        shown(desk, "File")
        desk.browser = Browser("Open", lambda path: None, lambda: None, Path.cwd(), takes_words=True)
        shown(desk, "File", 8)
        desk.browser = None
        desk.ask(Question("Really?", {"yes": lambda: None}))
        shown(desk, "File", 8)
        desk.questions.clear()
        desk.preferences.help = True
        shown(desk, "File")
    assert ("button", "stop") in seen.controls and len(seen.controls) > 20
    seen.bare -= PICTURES | IN_FRONT | {("button", "yes"), ("button", "cancel")}  # answers say what they do
    assert not seen.bare, bare(seen)


def test_a_tab_in_front_has_no_tooltip_over_its_controls(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = dressed(desk_with("one.npy"))
    with headless():
        shown(desk, "Light")
        with noticed(monkeypatch) as seen:
            shown(desk, "", 2)
    assert tips.TIPS["Light"] not in seen.texts and tips.TIPS["Cut"] in seen.texts


def test_a_question_is_as_wide_as_its_longest_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    desk, long = dressed(desk_with("one.npy")), "save " + "a_long_name_" * 6 + ".toml and close"
    wide: list[float] = []
    button = imgui.button

    def noted(words: str, size: imgui.ImVec2 | None = None) -> bool:
        found = bool(button(words, size))
        if words == long:
            wide.append(imgui.get_item_rect_size().x)
        return found

    with headless():
        desk.ask(Question("Really?", {long: lambda: None}))
        with monkeypatch.context() as patch:
            patch.setattr(imgui, "button", noted)
            shown(desk, "File", 6)
        assert wide[-1] >= imgui.calc_text_size(long).x


def test_an_answer_that_is_wider_than_the_window_is_shortened_and_a_tooltip_tells_it_whole(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    desk, long = dressed(desk_with("one.npy")), "save " + "a_long_name_" * 20 + ".toml and close"
    with headless(), noticed(monkeypatch) as seen:
        desk.ask(Question("Really?", {long: lambda: None}))
        shown(desk, "File", 4)
        (label,) = {label for name, label in seen.controls if name == "button" and label.endswith(f"###{long}")}
        text = label.partition("###")[0]
        assert text.startswith("save a_") and text.endswith(".toml and close") and "…" in text
        assert imgui.calc_text_size(text).x < imgui.get_io().display_size.x
        assert ("button", label) not in seen.bare


def test_every_control_of_the_empty_window_has_a_tooltip(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = dressed(desk_with("one.npy"))
    desk.document = None
    with headless(), noticed(monkeypatch) as seen:
        shown(desk, "File")
    assert ("button", "open a sample") in seen.controls
    seen.bare -= IN_FRONT
    assert not seen.bare, bare(seen)


@pytest.mark.parametrize("label", ["opacity /5.97 mm", "opacity is per (mm)", "error at rest (/255)"])
def test_units_are_no_part_of_a_name(label: str) -> None:
    assert tips.tip(label) in tips.TIPS.values()


def test_a_control_without_a_tooltip_has_none() -> None:
    assert tips.tip("plane 1") == ""


def pressed(name: str) -> None:
    """A key that is pressed and released in the next frames."""
    for down in (True, False):
        imgui.get_io().add_key_event(getattr(imgui.Key, name), down)


def test_a_list_that_drops_down_hears_arrows_and_enter() -> None:
    names, position, seen = ("one", "two", "three"), 1, []
    with headless():
        for key in ("", "down_arrow", "down_arrow", "up_arrow", "home", "end", "home", "enter"):
            if key:
                pressed(key)
            for frame in range(2):
                imgui.new_frame()
                imgui.begin("panel")
                if not key and not frame:
                    imgui.open_popup("list")
                if imgui.begin_popup("list"):
                    position, chosen = parts.listed(names, position)
                    imgui.end_popup()
                imgui.end()
                imgui.end_frame()
                if not frame:
                    seen.append((names[position], chosen))
        assert not imgui.is_popup_open("list", imgui.PopupFlags_.any_popup)
    found = [name for name, _ in seen]
    assert found == ["two", "three", "three", "two", "one", "three", "one", "one"]
    assert [chosen for _, chosen in seen] == [False] * 7 + [True]


def test_a_text_that_is_too_wide_keeps_its_beginning_and_its_end() -> None:
    with headless():
        imgui.new_frame()
        for width in (10.0, 60.0, 120.0, 1e4):
            text = parts.fitting("a rather long name of a file.nii.gz", width)
            assert imgui.calc_text_size(text).x <= width
            assert width < 60 or (text[0], text[-1]) == ("a", "z")
            assert ("…" in text) == (10 < width < 1e4)
        imgui.end_frame()
