"""Volumes, masks and meshes come into a scene and leave it; what is drawn of it headless is the same picture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.desks import SIZE, desk_with, done, said, settled
from support.windows import ball, display, eight_bits, script, texvol, viewed  # noqa: F401 (display is a fixture)

from texvol.annotation import Annotation, with_room
from texvol.formats.readers import load
from texvol.geometry import Mesh, save_mesh
from texvol.scene import transfer
from texvol.util.errors import InputError
from texvol.window import contents, navigation, opening, recent, saving
from texvol.window import script as scripts
from texvol.window.commands import TABS
from texvol.window.document import opened_file
from texvol.window.editing import owner_of, with_own

ERROR = str(1 / 255)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A ball, another volume that reaches farther, two masks of the ball and a mesh."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    ball(tmp_path, 24)
    rng = np.random.default_rng(5)
    np.save(tmp_path / "wide.npy", rng.random((6, 20, 40)).astype(np.float32))
    np.save(tmp_path / "channels.npy", rng.random((2, 6, 7, 8)).astype(np.float32))
    half = np.zeros((24, 24, 24), np.uint8)
    half[:, :, :12] = 1
    np.save(tmp_path / "half.npy", half)
    np.save(tmp_path / "ramp.npy", np.broadcast_to(np.arange(24.0, dtype=np.float32), (24, 24, 24)))
    corners = [(2.0, 2.0, 10.0), (20.0, 2.0, 10.0), (2.0, 20.0, 14.0)]
    save_mesh(Mesh(np.array(corners), np.array([(0, 1, 2)])), tmp_path / "sail.ply")
    return tmp_path


def test_each_thing_that_is_added_is_one_step_back(folder: Path) -> None:
    desk = desk_with("ball.npy")
    document = done(desk, "add wide.npy", "mask half.npy", "add sail.ply")
    scene = document.scene
    assert [len(scene.added), len(scene.geometry)] == [1, 1] and scene.mask is not None and not said(desk)
    # In the hue that the command line gives it.
    expected = transfer.proposed_beside(scene.added[0].volume, 0)
    assert np.array_equal(scene.added[0].transfer_function.colors, expected.colors)
    held = []
    while document.history.past:
        held.append((len(document.scene.added), document.scene.mask is not None, len(document.scene.geometry)))
        document.undo()
    assert held == [(1, True, 1), (1, True, 0), (1, False, 0)]
    for _ in held:
        document.redo()
    assert document.scene.geometry == scene.geometry and document.scene.added == scene.added


def test_several_that_are_added_at_once_come_one_after_the_other(folder: Path) -> None:
    desk = desk_with("ball.npy")
    opening.drop(desk, ["wide.npy", "ball.npy", "sail.ply"], adds=True)
    scene = settled(desk).document.scene  # type: ignore[union-attr]
    assert [Path(each.volume.name).name for each in scene.added] == ["wide.npy", "ball.npy"]
    one, other = (each.transfer_function.colors[2] for each in scene.added)  # type: ignore[union-attr]
    assert not np.allclose(one, other), "in different hues"
    assert len(scene.geometry) == 1


def test_what_can_not_be_added_is_said_and_changes_nothing(folder: Path) -> None:
    (folder / "broken.nrrd").write_text("NRRD0004\nnonsense\n")
    (folder / "broken.ply").write_text("no ply")
    desk = desk_with("ball.npy")
    document = desk.document
    assert document is not None
    before = document.scene
    for command, reason in (
        ("add broken.nrrd", "broken.nrrd"),
        ("add broken.ply", "named PLY, but its content is not PLY"),
        ("add none.npy", "none.npy"),
        ("mask wide.npy", "a mask must have as many samples as its volume"),
    ):
        desk.messages.clear()
        done(desk, command)
        assert reason in said(desk) and all(each.is_fault for each in desk.messages)
    desk.change(mode="mip")
    desk.messages.clear()
    done(desk, "add wide.npy")
    assert "mode composite" in said(desk) and not document.scene.added
    document.undo()
    assert document.scene.mask is before.mask and document.scene.geometry == () and not document.history.past


def test_a_view_that_nobody_chose_takes_in_what_is_added(folder: Path) -> None:
    desk = desk_with("ball.npy")
    document = desk.document
    assert document is not None
    before = document.view.camera
    done(desk, "add wide.npy")
    assert document.scene.box.dimensions == (1, 1, 1) and document.view.camera.height > before.height
    document.look(navigation.orbit(document.view, 0.3, 0.1))
    chosen = document.view.camera
    done(desk, "add wide.npy")
    assert document.view.camera == chosen


def test_words_of_the_command_line_say_how_a_volume_is_read() -> None:
    assert contents.of_added("--channel 1 --tf inferno") == {"channel": 1, "tf": "inferno"}
    assert contents.of_opened("--shape 8,8,8 --dtype '>i2' --eye -1,2,3") == {
        "shape": (8, 8, 8), "dtype": ">i2", "eye": (-1, 2, 3),
    }  # fmt: skip
    assert contents.of_added("") == contents.of_opened(" ") == {}
    for words in ("--chanel 1", "channel 1", "--channel x", "--tf", "'a"):
        with pytest.raises(InputError):
            contents.of_added(words)


def test_an_added_volume_is_read_as_it_is_said(folder: Path) -> None:
    desk = desk_with("ball.npy")
    opening.add(desk, "channels.npy", contents.of_added("--channel 1 --transform 1,0,0,5,0,1,0,0,0,0,1,0"))
    (added,) = settled(desk).document.scene.added  # type: ignore[union-attr]
    assert np.array_equal(added.volume.values, load("channels.npy", channel=1).values)
    assert added.volume.origin.tolist() == [5, 0, 0]


@pytest.mark.parametrize("whose", [0, 1])
def test_a_mask_goes_with_its_volume(folder: Path, whose: int) -> None:
    desk = desk_with("wide.npy" if whose else "ball.npy")
    document = done(desk, "add ball.npy" if whose else "add wide.npy")
    volume = document.scene.volumes[whose]
    opening.mask(desk, volume, "ramp.npy", (4.0, 20.0))
    settled(desk)
    mask = owner_of(document.scene, whose).mask
    assert mask is not None and mask.source["fade"] == [4, 20] and owner_of(document.scene, 1 - whose).mask is None
    desk.change(**with_own(document.scene, whose, mask=None))
    assert owner_of(document.scene, whose).mask is None


def test_a_mask_of_a_volume_that_was_turned_lies_where_its_file_says(folder: Path) -> None:
    import nrrd

    for name, space in (("lps", "left-posterior-superior"), ("ras", "right-anterior-superior")):
        head = {"space": space, "space directions": np.eye(3), "space origin": [5.0, -3.0, 2.0]}
        nrrd.write(f"{name}.nrrd", np.ones((6, 7, 8), np.uint8), head)
    nrrd.write("elsewhere.nrrd", np.ones((6, 7, 8), np.uint8), head | {"space origin": [9.0, -3.0, 2.0]})
    desk = desk_with("lps.nrrd")
    document = done(desk, "add ras.nrrd")
    assert document.scene.volumes[1].origin.tolist() == [-5, 3, 2]
    for name, warns in (("ras", False), ("elsewhere", True)):
        desk.messages.clear()
        opening.mask(desk, document.scene.volumes[1], f"{name}.nrrd")
        settled(desk)
        assert owner_of(document.scene, 1).mask is not None
        assert bool(said(desk)) == warns == ("4 voxels away" in said(desk))


def test_a_mask_of_other_numbers_than_weights_fades_in_over_all_of_them(folder: Path) -> None:
    mask = owner_of(done(desk_with("ball.npy"), "mask ramp.npy").scene, 0).mask
    assert mask is not None and list(mask.source["fade"]) == [0, 23]
    assert np.allclose(mask.array[3, 3], np.linspace(0, 1, 24))


def test_a_mesh_in_another_colour_is_the_same_surface(folder: Path) -> None:
    document = done(desk_with("ball.npy"), "add sail.ply")
    (before,) = document.scene.geometry
    document.change(**contents.with_look(document.scene, 0, (0.1, 0.2, 0.3), 0.25))
    (after,) = document.scene.geometry
    assert (after.color, after.opacity) == ((0.1, 0.2, 0.3), 0.25)
    assert before.opacity == 1 and before.color != after.color
    assert after.vertices is before.vertices


def test_dropped_volumes_are_asked_about_and_the_rest_is_plain(folder: Path) -> None:
    desk = desk_with("ball.npy")
    document = desk.document
    assert document is not None
    opening.drop(desk, ["wide.npy"])
    assert desk.question is not None and "wide.npy" in desk.question.text and desk.loading is None
    opening.drop(desk, ["sail.ply"])
    assert len(settled(desk).document.scene.geometry) == 1  # type: ignore[union-attr]
    saving.save_scene("saved.toml", document, SIZE)
    opening.drop(desk, ["saved.toml"])
    assert settled(desk).document is not document and desk.question is None
    empty = desk_with("ball.npy")
    empty.document = None
    opening.drop(empty, ["ball.npy", "wide.npy", "sail.ply"])
    assert settled(empty).document is not None
    assert [Path(each.name).name for each in empty.document.scene.volumes] == ["ball.npy", "wide.npy"]


def test_what_is_not_saved_is_marked_until_it_is_saved_or_undone(folder: Path) -> None:
    desk = desk_with("ball.npy")
    document = desk.document
    assert document is not None
    assert desk.title == "ball.npy - texvol" and not document.unsaved
    document.look(navigation.orbit(document.view, 0.3, 0.1))
    assert not document.unsaved, "to look from elsewhere is no change of the scene"
    desk.change(background=(1.0, 0.0, 0.0))
    assert desk.title == "ball.npy* - texvol"
    document.undo()
    assert not document.unsaved
    done(desk, "add wide.npy", "save kept.toml")
    assert desk.title == "kept.toml - texvol"
    done(desk, "add sail.ply")
    assert document.unsaved
    document.undo()
    assert not document.unsaved
    document.undo()
    assert document.unsaved, "what was saved had two volumes"
    document.redo()
    document.show(annotation=Annotation(box=True))
    assert document.unsaved
    document.show(annotation=Annotation())
    assert not document.unsaved


@pytest.mark.parametrize("command", ["reset", "frame", "axis +x", "axis -z"])
def test_views_of_the_whole_leave_annotation_its_room(folder: Path, command: str) -> None:
    pytest.importorskip("PIL", reason="letters need the extra: pip install '.[annotation]'")
    desk = desk_with("ball.npy")
    plain = done(desk, command).view.camera
    legend = Annotation(legend=True)
    document = done(desk)
    document.show(annotation=legend)
    document.look(navigation.dolly(document.view, 0.5, (0.0, 0.0), document.scene.box))
    roomy = done(desk, command).view.camera
    wanted = with_room(plain, document.scene, SIZE, legend)
    assert roomy.height == pytest.approx(wanted.height, rel=1e-12) != plain.height
    np.testing.assert_allclose([roomy.eye, roomy.target, roomy.up], [wanted.eye, wanted.target, wanted.up], atol=1e-9)


def test_a_sample_is_opened_without_a_word_and_is_no_recent_file(folder: Path) -> None:
    desk = desk_with("ball.npy")
    before = recent.files()
    opening.sample(desk)
    settled(desk)
    assert [each.text for each in desk.messages if each.is_fault] == [] and recent.files() == before


def test_recent_files_keep_every_volume_and_how_it_was_read(folder: Path) -> None:
    words = "--mask half.npy --add channels.npy --add-channel 1 --add-transform 1,0,0,5,0,1,0,0,0,0,1,0 --add wide.npy"
    first = opened_file("ball.npy", SIZE, contents.of_opened(words))
    recent.remember("ball.npy", first.scene)
    (found,) = recent.files()
    assert found.text == "ball.npy + channels.npy, channel 1 + wide.npy"
    again = opened_file(found.path, SIZE, found.options)
    assert len(again.scene.added) == 2 and again.scene.mask is not None
    for one, other in zip(first.scene.volumes, again.scene.volumes, strict=True):
        assert np.array_equal(one.values, other.values) and np.array_equal(one.origin, other.origin)
    recent.remember("ball.npy", again.scene)
    assert len(recent.files()) == 1, "it is the same again"
    for text in ('[{"path": "ball.npy", "add": [{"no": 1}]}]', '[{"path": "ball.npy", "add": 3}]'):
        recent.state_file().write_text(text)
        assert recent.files() == []


def test_a_script_that_asks_for_what_there_is_not_is_refused_with_its_line(tmp_path: Path) -> None:
    command = "unknown command"
    for step, reason in (
        *(({"do": "command", "name": name}, command) for name in ("tab Mater", "tab", "axis +w", "turn", "")),
        ({"do": "screenshot"}, '"file" is missing: a screenshot needs'),
        ({"do": "screenshot", "file": "/nowhere/a.png"}, "its folder /nowhere does not exist"),
        ({"do": "save", "file": "/nowhere/a.toml"}, "its folder /nowhere does not exist"),
        ({"do": "save", "file": "a.png"}, "must end with .toml"),
        ({"kind": "resize", "x": -5, "y": 0}, "window size must be at least 1 x 1"),
    ):
        with pytest.raises(InputError, match=reason) as caught:
            scripts.read(tmp_path / script(tmp_path, [{"do": "rest"}, {"t": 1, **step}]))
        assert str(caught.value).startswith(f"{tmp_path}/script.jsonl:2: ")
    (tmp_path / "script.jsonl").write_text('{"do": "rest"}\nrest\n')
    with pytest.raises(InputError, match="script.jsonl:2: step 'rest'"):
        scripts.read(tmp_path / "script.jsonl")
    steps = [{"do": "command", "name": f"tab {name}"} for name in TABS]
    assert len(scripts.read(tmp_path / script(tmp_path, steps))) == len(TABS)


def test_what_was_added_in_the_window_is_drawn_headless_to_the_bit(display: str, folder: Path) -> None:  # noqa: F811
    rest = {"do": "rest"}
    steps: list[dict[str, Any]] = [
        rest,
        {"t": 0.1, "kind": "drop", "names": ["wide.npy"], "modifiers": ["ctrl"]},
        {"t": 0.2, "kind": "drop", "names": ["sail.ply"]},
        {"t": 0.3, "do": "command", "name": "mask half.npy"},
        {"t": 0.6, **rest},
        {"t": 0.6, "do": "screenshot", "file": "seen.png"},
        {"t": 0.6, "do": "save", "file": "saved.toml"},
        *({"t": 0.7 + 0.1 * n, "do": "command", "name": "undo"} for n in range(3)),
        {"t": 1.1, **rest},
        {"t": 1.1, "do": "screenshot", "file": "undone.png"},
        {"t": 1.1, "do": "save", "file": "undone.toml"},
    ]
    words = ["--size", "100x80", "--no-panels", "--script", script(folder, steps)]
    ended = viewed(display, folder, "ball.npy", *words)
    assert (ended.returncode, ended.stderr) == (0, "")
    saved, undone = ((folder / f"{name}.toml").read_text() for name in ("saved", "undone"))
    assert all(f'"{name}"' in saved for name in ("wide.npy", "sail.ply", "half.npy"))
    assert not any(f'"{name}"' in undone for name in ("wide.npy", "sail.ply", "half.npy"))
    pictures = []
    for name in ("saved", "undone"):
        texvol(folder, "render", "--scene", f"{name}.toml", "--max-error", ERROR, "-o", f"{name}.png")
        pictures.append(eight_bits(folder / f"{name}.png"))
    assert (pictures[0] == eight_bits(folder / "seen.png")).all()
    assert (pictures[1] == eight_bits(folder / "undone.png")).all()
    assert (pictures[0] != pictures[1]).any()


def test_the_question_about_a_dropped_file_is_answered_by_mouse_and_key(display: str, folder: Path) -> None:  # noqa: F811
    rest = {"do": "rest"}

    def tapped(t: float, name: str) -> list[dict[str, Any]]:
        return [{"t": t + 0.06 * up, "kind": "key", "name": name, "down": not up} for up in (False, True)]

    # The question's window is in the middle: a title, and buttons of which the second adds.
    click = [{"t": 0.7 + 0.06 * up, "kind": "button", "name": "left", "down": not up} for up in (False, True)]
    steps: list[dict[str, Any]] = [
        rest,
        {"t": 0.1, "kind": "drop", "names": ["wide.npy"]},
        *tapped(0.3, "escape"),
        {"t": 0.4, "kind": "drop", "names": ["wide.npy"]},
        {"t": 0.65, "kind": "move", "x": 200, "y": 150},
        *click,
        {"t": 1.0, **rest},
        {"t": 1.0, "do": "save", "file": "added.toml"},
        {"t": 1.1, "kind": "drop", "names": ["wide.npy"]},
        *tapped(1.3, "enter"),
        {"t": 1.6, **rest},
        {"t": 1.6, "do": "save", "file": "opened.toml"},
    ]
    words = ["--size", "400x300", "--no-panels", "--max-error", "0.1", "--light", "none"]
    words += ["--script", script(folder, steps)]
    ended = viewed(display, folder, "ball.npy", *words)
    assert (ended.returncode, ended.stderr) == (0, "")
    added = (folder / "added.toml").read_text()
    assert added.count('file = "wide.npy"') == 1 and 'volume = "ball.npy"' in added
    assert 'volume = "wide.npy"' in (folder / "opened.toml").read_text()
    kept = json.loads((folder / "state/texvol/recent.json").read_text())
    assert [Path(each).name for each in kept] == ["wide.npy", "ball.npy"]
