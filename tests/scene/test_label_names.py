"""Names and colours of labels are those of the table unless the user chose: pictures, legends, scene files."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

import numpy as np
import pytest

import texvol
from texvol.__main__ import main
from texvol.annotation.legend_content import contents_of
from texvol.annotation.lettering import Lettering
from texvol.comparison.pictures import read_picture
from texvol.options.scene_options import SceneOptions
from texvol.provenance.stored_scene import stored_scene_of
from texvol.scene.display import straight_colors
from texvol.scene.label_table import LabelEntry, LabelTable
from texvol.scene.scene import Scene
from texvol.scene.transfer.labels import OPACITY, label_function, parse_labels
from texvol.scene.volume import Volume

FIRST, SECOND = (0.25, 0.5, 0.125), (0.0, 0.75, 0.5)  # of no list
TABLE = LabelTable({1: LabelEntry("liver", FIRST), 2: LabelEntry("spleen", SECOND), 3: LabelEntry("air", None, False)})
VALUES = np.arange(5, dtype=np.uint8).repeat(8).reshape(5, 2, 4)


def of_labels(table: LabelTable | None = TABLE) -> Volume:
    return Volume(VALUES, labels=True, label_table=table)


def color(medium: texvol.TransferFunction, label: int) -> tuple[float, ...]:
    return tuple(straight_colors(medium, np.array([float(label)]))[0].tolist())


def opacity(medium: texvol.TransferFunction, label: int) -> float:
    return float(-np.expm1(-medium.classify(np.array([float(label)])).extinction[0]))


def test_labels_have_the_colours_of_the_table_and_others_those_of_the_list() -> None:
    medium, plain = label_function(of_labels()), label_function(of_labels(None))
    assert color(medium, 1) == FIRST and color(medium, 2) == SECOND
    assert color(medium, 4) == color(plain, 4) != color(plain, 1)
    assert opacity(medium, 1) == pytest.approx(OPACITY) and opacity(medium, 3) == 0 and opacity(plain, 3) > 0
    assert medium.materials == ("liver", "spleen", "label 4")


def test_what_the_user_chose_wins() -> None:
    volume = of_labels()
    blue = (0.0, 0.0, 1.0)
    medium = label_function(volume, **parse_labels("1=#0000ff,3=#0000ff,2=0.7")._asdict())
    assert color(medium, 1) == blue and color(medium, 2) == SECOND
    assert opacity(medium, 2) == pytest.approx(0.7)
    assert opacity(medium, 3) == pytest.approx(OPACITY), "a label that is named shows, hidden by the table or not"
    assert opacity(label_function(volume, others=0.5), 3) == pytest.approx(0.5)
    assert color(label_function(volume, colors="tab20"), 1) == color(label_function(of_labels(None), colors="tab20"), 1)


def test_a_legend_has_the_names_and_no_letter_that_its_font_lacks() -> None:
    scene = Scene(of_labels(), label_function(of_labels()))
    (content,) = contents_of(scene, "", None, Lettering(None))
    assert [name for name, _ in content.entries] == ["liver", "spleen", "4"]
    table = LabelTable({1: LabelEntry("肝臓 a", FIRST)})
    scene = Scene(of_labels(table), label_function(of_labels(table)))
    (content,) = contents_of(scene, "", None, Lettering(None))
    assert content.entries[0][0] == "?? a"


def test_more_labels_than_a_transfer_function_names_have_their_names_in_the_legend() -> None:
    values = np.arange(100, dtype=np.uint8).reshape(4, 5, 5)
    table = LabelTable({label: LabelEntry(f"region {label}") for label in range(1, 100)})
    volume = Volume(values, labels=True, label_table=table)
    (content,) = contents_of(Scene(volume, label_function(volume)), "", None, Lettering(None))
    assert [name for name, _ in content.entries] == [f"region {label}" for label in range(1, 100)]


def drawn_by(path: str) -> Scene:
    """The scene in the header of a picture."""
    return stored_scene_of(read_picture(path).attributes, name=path, folder=".").scene


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with labels, their names in another folder, and a scene file that names both."""
    np.save(tmp_path / "labels.npy", VALUES)
    (tmp_path / "names").mkdir()
    (tmp_path / "names" / "organs.txt").write_text("1 liver 255 0 0 0\n2 spleen 0 255 0 0\n")
    (tmp_path / "scene").mkdir()
    text = 'volume = "../labels.npy"\nlabel-names = "../names/organs.txt"\n'
    text += '[[add]]\nfile = "../labels.npy"\nlabel-names = "../names/organs.txt"\n'
    (tmp_path / "scene" / "s.toml").write_text(text)
    return tmp_path


def test_a_scene_file_names_tables_relative_to_its_folder(folder: Path) -> None:
    options = SceneOptions.of(scene=str(folder / "scene" / "s.toml"))
    scene = options.scene(options.load())
    assert scene.volume.labels and scene.transfer_function is not None
    assert scene.transfer_function.materials[:2] == ("liver", "spleen")
    assert scene.added[0].medium.materials[:2] == ("liver", "spleen")
    assert scene.volume.source["label_names"] == str(folder / "names" / "organs.txt")


def test_info_lists_names_and_render_uses_them(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["labels.npy", "--label-names", "names/organs.txt"]
    with contextlib.chdir(folder):
        assert main(["info", *words]) == 0
        page = capsys.readouterr().out
        assert main(["info", "--json", *words]) == 0
        labels = json.loads(capsys.readouterr().out)["labels"]
        assert main(["render", *words, "--size", "48", "--annotate", "legend", "-o", "x.png"]) == 0
        drawn = drawn_by("x.png")
        assert main(["info", "labels.npy", "--label-names", "names"]) == 2
        assert "names: is a folder" in capsys.readouterr().err
    assert "1: 8 liver\n" in page and "2 have names, from" in page
    assert labels["first"][1] == {"label": 1, "samples": 8, "name": "liver"} and labels["named"] == 2
    assert drawn.transfer_function is not None and drawn.transfer_function.materials[:2] == ("liver", "spleen")


def test_a_picture_is_drawn_again_without_the_table_that_is_gone(folder: Path) -> None:
    with contextlib.chdir(folder):
        assert main(["render", "labels.npy", "--label-names", "names/organs.txt", "--size", "48", "-o", "x.png"]) == 0
        (folder / "names" / "organs.txt").unlink()
        drawn = drawn_by("x.png")
    assert drawn.transfer_function is not None and drawn.transfer_function.materials[:2] == ("liver", "spleen")
