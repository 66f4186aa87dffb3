"""No work is lost: what is asked before the window closes, a scene is replaced or a file is overwritten."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from support.desks import desk_with, done, said, settled
from support.unlost import BLUE, GREEN, RED, asked, folder, keyed, writing  # noqa: F401 (a fixture)

from texvol.window import opening, recent, replaced
from texvol.window.commands import is_command, run
from texvol.window.events import Event
from texvol.window.navigation import orbit
from texvol.window.questions import CANCEL, Question
from texvol.window.steering import Viewport


def test_a_window_without_changes_closes_at_once() -> None:
    desk = desk_with("one.npy")
    done(desk, "close")
    assert desk.wants_close and desk.question is None


def test_closing_with_changes_asks_and_cancel_stays() -> None:
    desk = desk_with("one.npy")
    desk.change(background=RED)
    done(desk, "close")
    assert asked(desk, "one.npy has unsaved changes").words[-1] == CANCEL and not desk.wants_close
    done(desk, "close")
    assert len(desk.questions) == 1, "the same is asked once"
    keyed(desk, "escape")
    assert desk.question is None and not desk.wants_close and not Path("one-1.toml").exists()
    done(desk, "close", "answer close without saving")
    assert desk.wants_close and not Path("one-1.toml").exists()


def test_enter_saves_all_scenes_and_closes() -> None:
    desk = desk_with("one.npy")
    desk.change(background=RED)
    done(desk, "open two.npy")
    desk.change(background=GREEN)
    done(desk, "close")
    assert asked(desk, "2 scenes").notes == ("one.npy → one-1.toml", "two.npy → two-1.toml")
    keyed(desk, "enter")
    assert desk.wants_close
    for name, color in (("one", "[1.0, 0.0, 0.0]"), ("two", "[0.0, 1.0, 0.0]")):
        text = Path(f"{name}-1.toml").read_text()
        assert f'"{name}.npy"' in text and f"background = {color}" in text


def test_scenes_of_one_volume_are_told_apart_and_saved_in_files_of_their_own() -> None:
    desk = desk_with("one.npy")
    desk.change(background=RED)
    for color in (GREEN, BLUE):
        done(desk, "open one.npy")
        desk.change(background=color)
    done(desk, "close")
    notes = asked(desk, "3 scenes").notes
    assert notes == ("one.npy → one-1.toml", "one.npy → one-2.toml", "one.npy (shown) → one-3.toml")
    keyed(desk, "enter")
    assert desk.wants_close
    found = [desk_with(f"one-{number}.toml").document.scene.background for number in (1, 2, 3)]  # type: ignore[union-attr]
    assert found == [RED, GREEN, BLUE]


def test_volumes_whose_names_begin_alike_have_scenes_of_their_own(folder: Path) -> None:  # noqa: F811
    (folder / "one.raw.npy").write_bytes((folder / "two.npy").read_bytes())
    desk = desk_with("one.npy")
    desk.change(background=RED)
    done(desk, "open one.raw.npy")
    desk.change(background=GREEN)
    done(desk, "close")
    assert asked(desk, "2 scenes").notes == ("one.npy → one-1.toml", "one.raw.npy → one-2.toml")


def test_of_two_changed_scenes_of_one_file_the_shown_one_keeps_it() -> None:
    done(desk_with("one.npy"), "save kept.toml")
    desk = desk_with("kept.toml")
    desk.change(background=RED)
    done(desk, "open kept.toml")
    desk.change(background=GREEN)
    done(desk, "close")
    assert asked(desk, "2 scenes").notes == ("kept.toml → kept-1.toml", "kept.toml (shown) → kept.toml")
    keyed(desk, "enter")
    assert desk.wants_close and "[0.0, 1.0, 0.0]" in Path("kept.toml").read_text()
    assert "[1.0, 0.0, 0.0]" in Path("kept-1.toml").read_text()


def test_a_scene_does_not_replace_another_one_of_the_window_unasked() -> None:
    done(desk_with("one.npy"), "save kept.toml")
    desk = desk_with("kept.toml")
    desk.change(background=RED)
    done(desk, "open kept.toml")
    desk.change(background=GREEN)
    done(desk, "save", "back", "save")
    question = asked(desk, "kept.toml holds another scene of this window")
    assert question.words == ("write kept-1.toml", "replace them", CANCEL)
    assert "This window has not written it." not in question.notes
    keyed(desk, "enter")
    assert "[0.0, 1.0, 0.0]" in Path("kept.toml").read_text() and "[1.0, 0.0, 0.0]" in Path("kept-1.toml").read_text()


def test_a_scene_that_can_not_be_saved_keeps_the_window_open(folder: Path) -> None:  # noqa: F811
    desk = desk_with("one.npy")
    desk.change(background=RED)
    done(desk, "close")
    (folder / "gone").mkdir()
    os.chdir("gone")
    (folder / "gone").rmdir()
    keyed(desk, "enter")
    assert not desk.wants_close and desk.document is not None and desk.document.unsaved and said(desk)


def test_closing_while_a_file_is_written_asks_and_may_wait() -> None:
    desk = desk_with("one.npy")
    clerk = writing(desk)
    done(desk, "picture a.png", "picture b.png")
    assert [job["path"] for job in clerk.jobs] == ["a.png"], "one after the other"
    done(desk, "close")
    asked(desk, "2 files are being written")
    keyed(desk, "enter")
    assert not desk.wants_close
    clerk.done(desk)
    assert not desk.wants_close and [job["path"] for job in clerk.jobs] == ["b.png"]
    clerk.done(desk)
    assert desk.wants_close


def test_changes_made_while_the_window_waits_for_a_file_are_asked_about() -> None:
    desk = desk_with("one.npy")
    clerk = writing(desk)
    desk.change(background=RED)
    done(desk, "picture a.png", "close", "answer close without saving", "answer close when written")
    desk.change(background=GREEN)
    clerk.done(desk)
    assert not desk.wants_close
    asked(desk, "one.npy has unsaved changes")
    done(desk, "answer cancel", "picture a.png", "close", "answer close without saving", "answer close when written")
    clerk.done(desk)
    assert desk.wants_close, "no change is newer than the answer"


def test_pictures_that_wait_to_be_written_have_names_of_their_own() -> None:
    desk = desk_with("one.npy")
    clerk = writing(desk)
    done(desk, "picture", "picture", "picture")
    for name in ("one-1.png", "one-2.png", "one-3.png"):
        assert [job["path"] for job in clerk.jobs] == [name]
        clerk.done(desk)
    done(desk, "picture a.png", "picture b.png", "picture b.png")
    assert asked(desk, "b.png is still to be written").words == ("write b-1.png", "replace it", CANCEL)
    keyed(desk, "escape")
    done(desk, "picture a.png")
    assert asked(desk, "a.png is still to be written").words[0] == "write a-1.png"
    keyed(desk, "escape")
    desk.stop_writing()
    done(desk, "picture b.png")
    assert desk.question is None


def test_a_file_that_fails_keeps_the_window_open_and_stopping_does_not() -> None:
    desk = desk_with("one.npy")
    clerk = writing(desk)
    done(desk, "picture a.png", "close", "answer close when written")
    clerk.done(desk, "failed")
    assert not desk.wants_close
    done(desk, "picture a.png", "picture b.png", "close", "answer stop and close")
    assert desk.wants_close and not clerk.jobs and not desk.orders


def test_what_another_scene_replaces_comes_back_with_its_view_and_history() -> None:
    desk = desk_with("one.npy")
    first = desk.document
    assert first is not None
    desk.change(background=RED)
    desk.change(background=GREEN)
    turned = orbit(first.view, 0.5, 0.2)
    first.look(turned)
    second = done(desk, "open two.npy")
    assert second is not first and "undo (ctrl-z) returns to one.npy" in said(desk)
    desk.change(background=BLUE)
    assert done(desk, "undo") is second and not second.history.past
    assert done(desk, "undo") is first and "one.npy again" in said(desk) and "opened two.npy" not in said(desk)
    assert first.scene.background == GREEN and first.view == turned and first.unsaved
    assert done(desk, "undo").scene.background == RED
    assert done(desk, "redo", "redo") is second and second.scene.background != BLUE
    assert done(desk, "redo").scene.background == BLUE and not desk.can_step(back=False)


def test_a_scene_comes_back_in_the_view_in_which_it_was_left() -> None:
    desk = desk_with("one.npy")
    first = desk.document
    assert first is not None
    first.frame_home(desk.pixels)
    desk.change(crop=((0.0, 2.0), (0.0, 2.0), (0.0, 2.0)))  # what shows is framed when the window is resized, not now
    before = first.view
    assert done(desk, "open two.npy", "undo") is first and first.at_home and first.view == before


def test_back_and_forward_leave_the_steps_alone() -> None:
    desk = desk_with("one.npy")
    first, second = desk.document, done(desk, "open two.npy")
    desk.change(background=BLUE)
    assert done(desk, "back") is first
    assert first is not None and done(desk, "back") is first, "there is none before"
    assert done(desk, "forward") is second and second.scene.background == BLUE


def test_a_scene_that_was_undone_is_kept_when_a_third_is_opened() -> None:
    desk = desk_with("one.npy")
    second = done(desk, "open two.npy")
    desk.change(background=BLUE)
    done(desk, "back", "open three.npy")
    assert [each.name for each in desk.documents] == ["two.npy", "one.npy", "three.npy"]
    done(desk, "close")
    asked(desk, "two.npy has unsaved changes")
    done(desk, "answer cancel", "back", "back")
    assert second.scene.background == BLUE and desk.document is second


def test_old_scenes_go_when_memory_gets_scarce_but_changes_only_when_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    size = 6 * 7 * 8 * 4
    desk = desk_with("one.npy")
    desk.change(background=RED)
    done(desk, "open two.npy")
    # A quarter of it has room for one volume, beside the one that is open.
    monkeypatch.setattr(replaced, "free_memory", lambda: 4 * size + 3)
    done(desk, "open three.npy")
    asked(desk, "one.npy has unsaved changes, and memory gets scarce")
    keyed(desk, "escape")
    assert [each.name for each in desk.documents] == ["one.npy", "two.npy", "three.npy"]
    done(desk, "open one.npy")
    assert [each.name for each in desk.documents] == ["one.npy", "one.npy"], "the others had no changes"
    desk.replaced.kept.clear()
    desk.change(background=RED)
    done(desk, "open two.npy")
    keyed(desk, "enter")
    assert [each.name for each in desk.documents] == ["one.npy", "two.npy"] and Path("one-1.toml").exists()


def test_a_question_is_answered_by_keys_and_hears_all_of_them() -> None:
    question = Question("?", {"yes": lambda: None, "no": lambda: None})
    down = [Event("key", name=name, down=True) for name in ("x", "down", "tab", "up", "enter")]
    assert [question.hear(event) for event in down] == [None, None, None, None, "no"]
    assert question.hear(Event("key", name="enter")) is None
    desk = desk_with("one.npy")
    assert not desk.hear(down, typing=False)
    desk.ask(question)
    assert desk.hear(down, typing=True) and desk.question is question, "they are letters of a field"
    desk.reply("perhaps")
    assert "it must be one of: yes, no, cancel" in said(desk)
    assert is_command("answer yes")
    run(desk, "answer yes")
    run(desk, "answer yes")
    assert "no question is asked" in said(desk)


def test_a_drop_asks_and_says_that_the_scene_is_kept() -> None:
    desk = desk_with("one.npy")
    opening.drop(desk, ["two.npy"])
    assert asked(desk, "two.npy").notes == ("one.npy is kept: undo returns to it.",)
    keyed(desk, "enter")
    assert settled(desk).document is not None and desk.document.name == "two.npy"  # type: ignore[union-attr]


def test_what_another_scene_replaces_comes_back_with_its_slices() -> None:
    desk = desk_with("one.npy")
    layout = desk.layout
    assert desk.document is not None
    layout.follow(desk.document.scene)
    layout.step("axial", 2)
    layout.zoom, layout.window = 3.0, (0.25, 0.5)
    index = layout.index.tolist()
    layout.follow(done(desk, "open two.npy").scene)
    assert layout.zoom == 1.0 and layout.index.tolist() != index
    layout.zoom = 2.0
    for command, zoom in (("undo", 3.0), ("redo", 2.0), ("back", 3.0)):
        layout.follow(done(desk, command).scene)
        assert layout.zoom == zoom
    assert (layout.window, layout.index.tolist()) == ((0.25, 0.5), index)


def test_a_scene_keeps_its_size_while_slices_are_shown_beside_it(folder: Path) -> None:  # noqa: F811
    desk = desk_with("one.npy")
    layout, whole, clerk = desk.layout, Viewport(0, 0, 301, 201), writing(desk)
    for mode in ("3D", "2x2", "axial", "3D"):
        layout.become(mode)
        desk.viewport = layout.arrange(whole, 1.0, True)
        desk.pixels = round(2 * desk.viewport.width), round(2 * desk.viewport.height)
        done(desk, "save")
        (scene,) = folder.glob("*.toml")
        assert 'size = "602x402"' in scene.read_text(), mode
        assert recent.files()[0].path == str(scene), "it is found again"
        done(desk, "picture")
        assert clerk.jobs[0]["size"] == (602, 402), mode
        desk.stop_writing()
