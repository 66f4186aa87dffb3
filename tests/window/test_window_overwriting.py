"""Files of others are not overwritten unasked."""

from __future__ import annotations

import os
from pathlib import Path

from support.desks import desk_with, done
from support.unlost import RED, asked, folder, keyed, writing  # noqa: F401 (a fixture)

from texvol.window import own_files
from texvol.window.questions import CANCEL


def test_a_scene_of_others_is_not_overwritten_unasked(folder: Path) -> None:  # noqa: F811
    Path("kept.toml").write_text("# of somebody else\n")
    Path("other.tf.json").write_text("{}")
    desk = desk_with("one.npy")
    done(desk, "save kept.toml")
    assert asked(desk, "kept.toml exists").words == ("write kept-1.toml", "replace it", CANCEL)
    assert "somebody else" in Path("kept.toml").read_text()
    keyed(desk, "enter")
    assert Path("kept-1.toml").exists() and "somebody else" in Path("kept.toml").read_text()
    done(desk, "save other.toml")
    asked(desk, "other.tf.json exists")
    keyed(desk, "down", "enter")
    assert Path("other.toml").exists() and Path("other.tf.json").read_text() != "{}"
    done(desk, "save other.toml", "save")
    assert desk.question is None, "it is the window's own now"


def test_its_own_scene_is_asked_about_once_somebody_else_has_changed_it(folder: Path) -> None:  # noqa: F811
    done(desk_with("one.npy"), "save kept.toml")
    desk = desk_with("kept.toml")
    desk.change(background=RED)
    done(desk, "save")
    assert desk.question is None and "[1.0, 0.0, 0.0]" in Path("kept.toml").read_text()
    Path("kept.toml").write_text(Path("kept.toml").read_text() + "# a word of mine\n")
    done(desk, "save")
    asked(desk, "kept.toml has been changed by another program")
    keyed(desk, "tab", "enter")
    assert "a word of mine" not in Path("kept.toml").read_text()


def test_pictures_of_others_are_not_overwritten_unasked() -> None:
    Path("a.png").write_text("mine")
    desk = desk_with("one.npy")
    clerk = writing(desk)
    done(desk, "picture a.png")
    asked(desk, "a.png exists")
    keyed(desk, "escape")
    assert not clerk.jobs
    done(desk, "picture a.png", "answer replace it")
    assert [job["path"] for job in clerk.jobs] == ["a.png"]
    clerk.done(desk)
    done(desk, "picture a.png")
    assert desk.question is None and len(clerk.jobs) == 1


def test_of_numbered_pictures_each_is_looked_at() -> None:
    from texvol.window import exporting

    Path("turn-2.png").write_text("mine")
    desk = desk_with("one.npy")
    clerk = writing(desk)
    assert desk.document is not None
    exporting.film(desk, desk.document, "turn-%d.png", (8, 8), 4, 30.0)
    asked(desk, "turn-2.png exists")
    keyed(desk, "enter")
    assert [job["path"] for job in clerk.jobs] == ["turn-%d-1.png"]


def test_names_that_are_proposed_have_no_file_of_others_beside_them() -> None:
    Path("one-1.tf.json").write_text("{}")
    desk = desk_with("one.npy")
    done(desk, "save")
    assert desk.question is None and Path("one-2.toml").exists() and Path("one-1.tf.json").read_text() == "{}"


def test_files_are_known_by_what_they_are_not_by_their_name(folder: Path) -> None:  # noqa: F811
    own = own_files.OwnFiles()
    Path("a").write_text("1")
    assert own.foreign("a") == "exists" and own.foreign("none") == ""
    own.wrote(["a"])
    os.symlink("a", "b")
    assert own.foreign(str(folder / "a")) == own.foreign("b") == ""
    Path("c").write_text("1")
    os.replace("c", "a")
    assert own.foreign("a") == "has been changed by another program"
