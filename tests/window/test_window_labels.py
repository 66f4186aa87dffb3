"""Labels in the window: search, one label alone, names from a file that undo takes away again."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.desks import SIZE, desk_with, done, said, settled

from texvol.options.scene_options import SceneOptions
from texvol.scene.display import straight_colors
from texvol.scene.label_names import names_of
from texvol.scene.transfer.labels import OPACITY, label_function
from texvol.scene.volume import Volume
from texvol.window import label_looks, opening, saving

NAMES = {1: "Left kidney", 2: "Right kidney", 11: "Liver", 12: "left lung"}
LABELS = (0, 1, 2, 11, 12, 30)


def test_a_search_finds_words_of_names_and_beginnings_of_numbers() -> None:
    def found(text: str) -> list[int]:
        return label_looks.matching(LABELS, NAMES, text)

    assert found("") == found("  ") == [1, 2, 11, 12, 30]
    assert found("kidney") == [1, 2] and found("LEFT kid") == [1] and found("left") == [1, 12]
    assert found("1") == [1, 11, 12] and found("30") == [30] and found("1 left") == [] and found("spleen") == []


opacities_of = st.dictionaries(st.integers(0, 9), st.sampled_from([0.0, 0.3, 1.0]), min_size=2)


@given(opacities_of, st.data())
def test_one_label_alone_and_back_is_as_before(opacities: dict[int, float], data: st.DataObject) -> None:
    one, other = (data.draw(st.sampled_from(sorted(opacities))) for _ in range(2))
    alone, before = label_looks.alone(opacities, one, None)
    assert [label for label, opacity in alone.items() if opacity > 0] == [one]
    assert alone[one] == (opacities[one] or OPACITY)
    # One after the other, and back to all.
    if other != one:
        alone, before = label_looks.alone(alone, other, before)
        assert [label for label, opacity in alone.items() if opacity > 0] == [other]
    back, before = label_looks.alone(alone, other, before)
    assert back == opacities and before is None


def test_what_is_shown_keeps_its_opacity_and_the_rest_is_left_alone() -> None:
    before = {1: 0.7, 2: 0.0, 3: 0.2}
    assert label_looks.with_shown(before, [1, 2], shown=True) == {1: 0.7, 2: OPACITY, 3: 0.2}
    assert label_looks.with_shown(before, [1, 2], shown=False) == {1: 0.0, 2: 0.0, 3: 0.2}


def seconds_of_a_change(count: int) -> float:
    """Median of the processor seconds that a change of one of `count` labels takes."""
    volume = Volume(np.arange(count, dtype=np.uint16).reshape(10, 10, -1), labels=True)
    look = label_looks.look_of(label_function(volume), volume)
    spent = []
    for number in range(7):
        start = time.thread_time()
        medium = label_function(volume, {**look.opacities, 5: number / 7}, look.colors)
        label_looks.look_of(medium, volume)
        label_looks.matching(look.opacities, {}, "11")
        spent.append(time.thread_time() - start)
    return sorted(spent)[3]


def test_a_change_takes_no_more_time_for_each_of_a_thousand_labels_than_of_some() -> None:
    # In milliseconds it depends on the machine; a change that looks at pairs of labels would take 36 times as long.
    assert seconds_of_a_change(1200) < 15 * seconds_of_a_change(200)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with labels, and names that are not beside them."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    values = np.zeros((6, 8, 10), np.uint8)
    values[1:3], values[3:5] = 1, 2
    for name in ("a", "b"):
        np.save(tmp_path / f"{name}.npy", values + (values > 0) * (0 if name == "a" else 1))
    (tmp_path / "names").mkdir()
    (tmp_path / "names" / "t.lut").write_text("1 1 0 0 kidney\n2 0 0 1 liver\n3 0 1 0 lung\n")
    (tmp_path / "names" / "far.txt").write_text("77 elsewhere\n")
    (tmp_path / "s.toml").write_text('volume = "a.npy"\nlabels = true\nlabel-look = "1=0.9"\n')
    return tmp_path


def test_names_are_taken_from_a_dropped_file_undone_and_saved(folder: Path) -> None:
    desk = desk_with("s.toml")
    document = done(desk)
    before = document.scene
    opening.drop(desk, ["names/t.lut"])
    settled(desk)
    scene = document.scene
    assert names_of(scene.volume, (1, 2)) == {1: "kidney", 2: "liver"} and document.unsaved
    shown = straight_colors(scene.transfer_function, np.array([1.0, 2.0]))
    assert shown == pytest.approx(np.array([[1, 0, 0], [0, 0, 1]]))
    opacity = label_looks.look_of(scene.transfer_function, scene.volume).opacities
    assert opacity[1] == pytest.approx(0.9) and opacity[2] == pytest.approx(OPACITY), "opacities stay"
    saving.save_scene("out/s.toml" if (folder / "out").mkdir() is None else "", document, SIZE)
    options = SceneOptions.of(scene="out/s.toml")
    again = options.scene(options.load())
    assert names_of(again.volume, (1, 2)) == {1: "kidney", 2: "liver"}
    assert 'label_names = "../names/t.lut"' in (folder / "out" / "s.toml").read_text()
    done(desk, "undo")
    assert document.scene.volume is before.volume and document.scene.transfer_function is before.transfer_function
    done(desk, "redo")
    assert names_of(document.scene.volume, (1,)) == {1: "kidney"}


def test_names_are_for_the_volume_that_is_edited(folder: Path) -> None:
    desk = desk_with("s.toml")
    document = done(desk)
    opening.add(desk, "b.npy", {"labels": True})
    settled(desk)
    opening.open_file(desk, "names/t.lut")
    settled(desk)
    assert names_of(document.scene.volumes[1], (2, 3)) == {2: "liver", 3: "lung"}
    assert names_of(document.scene.volume, (1, 2)) == {}


def test_a_file_that_names_nothing_is_said_and_changes_nothing(folder: Path) -> None:
    desk = desk_with("s.toml")
    document = done(desk)
    before = document.scene
    for path, words in (("names/far.txt", "names none of the labels of"), ("names/lost.txt", "cannot be read")):
        opening.open_file(desk, path)
        settled(desk)
        assert words in said(desk)
    assert document.scene is before and not document.unsaved
    desk = desk_with("a.npy")
    if not done(desk).scene.volume.labels:
        opening.open_file(desk, "names/t.lut")
        assert "need a volume of labels" in said(settled(desk))
