"""Looks to choose from: their list, their strips, and what choosing one does to the scene."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest
from support.desks import desk_with, done, said
from support.windows import PATIENCE

from texvol.scene.transfer import PRESETS, TransferFunction, label_function, preset
from texvol.scene.volume import Volume
from texvol.window import choosing, lineage, look_list, recent_looks, strips
from texvol.window.catalogue import Catalogue, Sheet
from texvol.window.commands import is_command
from texvol.window.look_list import OPENED, PROPOSED


@pytest.fixture(autouse=True)
def _own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def volume() -> Volume:
    z, y, x = np.mgrid[-1:1:20j, -1:1:22j, -1:1:24j]
    return Volume((1000 * np.exp(-3 * (x**2 + y**2 + z**2))).astype(np.float32))


def made(catalogue: Catalogue) -> Catalogue:
    catalogue.start()
    end = time.monotonic() + PATIENCE
    while len(catalogue.looks) + len(catalogue.faults) < len(catalogue.entries) and time.monotonic() < end:
        time.sleep(0.01)
    return catalogue


def test_every_preset_is_in_one_group_and_says_what_it_is_for() -> None:
    entries = look_list.measured([])
    assert sorted(each.key for each in entries) == sorted([*PRESETS, PROPOSED, OPENED])
    assert all(len(each.text) > 10 for each in entries)


def test_a_search_is_for_words_of_name_group_and_description() -> None:
    entries = look_list.measured(["/somewhere/bone.json"])

    def found(words: str) -> list[str]:
        return [each.key for each in entries if each.matches(words)]

    assert found("LUNG") == ["ct-lung"]
    assert "/somewhere/bone.json" in found("bone") and "ct-bone" in found("bone")
    assert found("ct muscle") == ["ct-soft-tissue", "ct-materials"]
    assert not found("nothing like it")


@pytest.mark.parametrize(
    "words, key",
    [("soft", "ct-soft-tissue"), ("bone", "ct-bone"), ("red", "mr"), ("mr", "mr"), ("ct mus", "ct-soft-tissue")],
)
def test_enter_takes_the_look_that_is_named_so_before_one_that_is_described_so(words: str, key: str) -> None:
    found = [each for each in look_list.measured([]) if each.matches(words)]
    assert look_list.best_match(found, words) == key
    assert look_list.best_match(found, "") is None and look_list.best_match([], words) is None


def test_all_looks_are_made_with_strips(tmp_path: Path) -> None:
    (tmp_path / "own.json").write_text(json.dumps({"points": [{"value": 5, "color": [1, 0, 0], "extinction": 1}]}))
    (tmp_path / "bad.json").write_text("{")
    files = [str(tmp_path / "own.json"), str(tmp_path / "bad.json")]
    opened = TransferFunction([0.0, 900.0], [(0, 0, 0), (0, 1, 0)], [0.0, 1.0])
    woken: list[int] = []
    found = made(Catalogue(volume(), 0, look_list.measured(files), opened, 1.0, lambda: woken.append(1)))
    assert sorted(found.looks) == sorted([*PRESETS, PROPOSED, OPENED, files[0]])
    assert list(found.faults) == [files[1]] and "bad.json" in found.faults[files[1]]
    assert found.looks[OPENED].transfer_function is opened and woken
    places = [found.sheet.place(key) for key in found.looks]
    assert None not in places and len(set(places)) == len(places)
    for sheet in (found.maps, found.shapes):
        assert sheet.place(look_list.OF_LOOK + "ct-bone") is not None
    assert found.maps.place("viridis") is not None and found.shapes.place("peak") is not None


def test_a_strip_shows_colours_up_to_the_opacity() -> None:
    medium = TransferFunction([0.0, 0.5, 0.5, 1.0], [(1, 0, 0), (1, 0, 0), (0, 0, 1), (0, 0, 1)], [0, 0, 50, 50])
    strip = strips.of_medium(medium, 1.0).astype(int)
    left, right = strip[:, 10], strip[:, -10]
    assert (right == (0, 0, 255)).all(), "opaque blue"
    assert (left[:, 0] < 150).all() and (left[:, 0] > left[:, 2]).all(), "faint red"
    half = strips.of_medium(TransferFunction([0.0, 1.0], [(1, 1, 1)] * 2, [np.log(2)] * 2), 1.0)[:, 48, 0]
    assert int((half == 255).sum()) == pytest.approx(strips.HEIGHT / 2, abs=1)
    assert half[-1] == 255 > half[0], "from below"


@pytest.mark.parametrize("name", ["contours", "boundaries", "fluorescence", "table-5-1", "ct-tissues"])
def test_a_strip_of_any_preset_shows_something(name: str) -> None:
    strip = strips.of_medium(preset(name, volume()), 1.0)
    empty = strips.of_medium(TransferFunction([0.0, 1.0], np.zeros((2, 3)), [0.0, 0.0]), 1.0)
    assert (strip.max(axis=(0, 2)) > empty.max() + 40).sum() > 4


def test_a_sheet_keeps_strips_apart_and_is_never_overfull() -> None:
    sheet = Sheet()
    for number in range(200):
        sheet.put(str(number), np.full((strips.HEIGHT, strips.WIDTH, 3), number, np.uint8))
    place = sheet.place("7")
    assert place is not None and sheet.place("199") is None
    row = int((place[0] + place[1]) / 2 * len(sheet.pixels))
    assert (sheet.pixels[row] == 7).all()


def test_commands_choose_looks_colours_and_opacity_and_undo_takes_them_back(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", volume().values)
    desk = desk_with(str(tmp_path / "v.npy"))
    before = done(desk).scene
    after = done(desk, "look ct-tissues", "colours inferno", "shape peak").scene
    medium = after.transfer_function
    found = lineage.lineage_of(medium)
    assert (found.title, found.colors.name) == ("ct-tissues *", "inferno")
    assert len(lineage.layers_of(medium).curve.points) == 3
    assert desk.document is not None and desk.document.unsaved
    seen = [done(desk, "undo").scene.transfer_function for _ in range(3)]
    assert seen[2] is before.transfer_function
    assert lineage.lineage_of(seen[1]).title == "ct-tissues" and not lineage.lineage_of(seen[1]).changed
    assert done(desk, "redo", "redo", "redo").scene.transfer_function is medium
    assert not said(desk)
    for command in ("look nothing", "colours ct-bone", "shape", "look"):
        assert not is_command(command)


def test_a_look_with_light_is_not_forced_on_a_scene_without(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", volume().values)
    desk = desk_with(str(tmp_path / "v.npy"))
    done(desk, "look fluorescence")
    assert desk.document is not None and desk.document.scene.lighting is None
    done(desk, "look mr")
    assert desk.document.scene.lighting is not None
    assert recent_looks.files() == []


def test_files_that_were_used_are_remembered_once_the_latest_first(tmp_path: Path) -> None:
    names = [str(tmp_path / f"{number}.json") for number in range(10)]
    for name in [*names, names[3]]:
        Path(name).write_text("{}")
        recent_looks.add(name)
    found = recent_looks.files()
    assert found[:2] == [names[3], names[9]] and len(found) == len(set(found)) == 8
    Path(names[3]).unlink()
    assert recent_looks.files()[0] == names[9]
    recent_looks.list_file().write_text('["x", 3, {')
    assert recent_looks.files() == []


def test_a_file_that_is_opened_is_a_look_of_the_list(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", volume().values)
    own = tmp_path / "own.json"
    own.write_text(json.dumps({"points": [{"value": 5, "color": [1, 0, 0], "extinction": 1}]}))
    desk = desk_with(str(tmp_path / "v.npy"))
    done(desk, f"open {own}")
    assert recent_looks.files() == [str(own)]
    assert lineage.lineage_of(done(desk).scene.transfer_function).title == "own.json"
    own.write_text("{")
    done(desk, f"open {own}")
    assert "own.json" in said(desk)


def test_labels_take_the_colours_of_a_list_and_keep_their_opacities(tmp_path: Path) -> None:
    values = np.zeros((6, 6, 6), np.uint8)
    values[1:3], values[4:] = 2, 5
    np.save(tmp_path / "labels.npy", values)
    desk = desk_with(str(tmp_path / "labels.npy"))
    seen = Volume(values, labels=True)
    given = label_function(seen, {2: 0.0, 5: 0.7}, {5: (1.0, 0.0, 0.0)})
    desk.change(volume=seen, transfer_function=given)
    for entry in look_list.of_labels():
        scene = done(desk).scene
        choosing.color_labels(desk, scene, 0, entry.key)
        found = done(desk).scene.transfer_function
        np.testing.assert_allclose(found.classify([2.0, 5.0]).extinction, given.classify([2.0, 5.0]).extinction)
        wanted = label_function(seen, None, entry.key)
        np.testing.assert_allclose(found.at(5.0)[:3], wanted.at(5.0)[:3])
    assert not said(desk)
