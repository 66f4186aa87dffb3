"""Measures on the command line, in scene files and in headers: the same everywhere, and one line for what is wrong."""

from __future__ import annotations

import csv
import io
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.windows import eight_bits

import texvol
from texvol.__main__ import main
from texvol.comparison.pictures import read_picture
from texvol.options import scene_options as options
from texvol.options.measures import as_text, measure, measure_table
from texvol.provenance.stored_scene import stored_scene_of
from texvol.scene.measures.measure import POINTS, Measure
from texvol.scene.measures.values import measured_labels

RULER, ANGLE, PROFILE = "ruler -1,0,0 4.5,2,0:wide", "angle 0,0,0 1,0,0 1,1,0", "profile:5 0,0,0 4,0,0"
BOX = "box 0,0,0 3,2,1"
NUMBERS = st.floats(-1e6, 1e6)
NAMES = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Zl", "Zp", "Zs")), max_size=9)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    z, y, x = np.indices((4, 5, 6))
    np.save("v.npy", (x + 10.0 * y + 100.0 * z).astype(np.float32))
    np.save("seg.npy", (x > 3).astype(np.uint8))
    return tmp_path


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


@st.composite
def measures(draw: Any) -> Measure:
    kind = draw(st.sampled_from(list(POINTS)))
    points = tuple(draw(st.tuples(NUMBERS, NUMBERS, NUMBERS)) for _ in range(POINTS[kind]))
    samples = draw(st.none() | st.integers(2, 900)) if kind == "profile" else None
    return Measure(kind, points, draw(NAMES), samples=samples)


@given(measures())
@settings(deadline=None)
def test_text_and_table_of_a_measure_are_the_measure(each: Measure) -> None:
    assert measure(as_text(each)) == each
    assert measure_table(each.as_table()) == each


def test_the_command_prints_what_python_measures(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["measure", "v.npy", "--unit", "mm", *(f"--measure={each}" for each in (RULER, ANGLE, BOX, PROFILE))]
    assert main(line) == 0
    rows = rows_of(capsys.readouterr().out)
    volume = texvol.load("v.npy").with_unit("mm")
    found = texvol.measure(volume, [measure(each) for each in (RULER, ANGLE, BOX, PROFILE)])
    for each in found:
        for quantity in each.quantities:
            (row,) = [one for one in rows if one["name"] == each.name and one["quantity"] == quantity.what]
            assert float(row["value"]) == quantity.value and row["unit"] == quantity.unit
    assert [float(row["value"]) for row in rows if row["quantity"] == "value"] == [0, 1, 2, 3, 4]
    # 4 x 3 x 2 samples: x + 10 y + 100 z.
    means = [float(row["value"]) for row in rows if row["quantity"] == "mean"]
    assert means == [1.5 + 10 + 50]


def test_labels_are_measured_without_being_asked_for(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["measure", "v.npy", "--add", "seg.npy", "--add-labels", "-o", "out.csv"]) == 0
    assert "out.csv: " in capsys.readouterr().out
    rows = rows_of((folder / "out.csv").read_text(encoding="utf-8"))
    assert {(row["label"], float(row["value"])) for row in rows if row["quantity"] == "samples"} == {
        ("0", 80.0), ("1", 40.0)
    }  # fmt: skip
    (found,) = measured_labels([texvol.load("seg.npy", labels=True)])
    assert [float(row["value"]) for row in rows] == [each.value for each in found.quantities]


def test_a_scene_file_holds_measures_that_the_line_replaces(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # A text may stand for a table.
    (folder / "s.toml").write_text(f'volume = "v.npy"\nmeasure = "{RULER}"\n', encoding="utf-8")
    (folder / "t.toml").write_text(
        'volume = "v.npy"\n[[measure]]\nkind = "ruler"\npoints = [[-1, 0, 0], [4.5, 2, 0]]\nname = "wide"\n'
        '[[measure]]\nkind = "profile"\npoints = [[0, 0, 0], [4, 0, 0]]\nsamples = 5\nshown = false\n',
        encoding="utf-8",
    )
    first = options.SceneOptions.of(scene="s.toml").annotation.measures
    second = options.SceneOptions.of(scene="t.toml").annotation.measures
    assert first == (measure(RULER),) and second[0] == first[0]
    assert (second[1].samples, second[1].shown) == (5, False)
    assert main(["measure", "--scene", "t.toml", f"--measure={ANGLE}"]) == 0
    assert {row["kind"] for row in rows_of(capsys.readouterr().out)} == {"angle"}


@pytest.mark.parametrize("suffix", ["png", "exr"])
@pytest.mark.parametrize("command", ["render", "raycast"])
def test_pictures_show_measures_and_their_headers_keep_them(folder: Path, command: str, suffix: str) -> None:
    plain = [command, "v.npy", "--size", "64x48", "--tf", "fog", "-o"]
    assert main([*plain, f"a.{suffix}"]) == 0
    assert main([*plain, f"b.{suffix}", f"--measure={RULER}", f"--measure={PROFILE}"]) == 0
    stored = stored_scene_of(read_picture(f"b.{suffix}").attributes, name="b")
    assert stored.measures == (measure(RULER), measure(PROFILE))
    assert stored_scene_of(read_picture(f"a.{suffix}").attributes, name="a").measures == ()
    if suffix == "png":
        assert (eight_bits(folder / "a.png") != eight_bits(folder / "b.png")).any()
    else:  # numbers stay numbers
        one, other = (read_picture(f"{name}.exr").pixels for name in "ab")
        assert np.array_equal(one, other)


@pytest.mark.parametrize(
    "wrong, said",
    [
        ("rod 0,0,0 1,1,1", "--measure: must be KIND X,Y,Z X,Y,Z [X,Y,Z][:NAME] with KIND of ruler, angle, box"),
        ("rulers 0,0,0 1,1,1", "did you mean 'ruler'?"),
        ("ruler 0,0,0", "--measure: must have 2 points X,Y,Z for a ruler, got 'ruler 0,0,0'"),
        ("angle 0,0,0 1,1,1", "--measure: must have 3 points X,Y,Z for an angle"),
        ("ruler 0,0 1,1,1", "--measure: must be a point X,Y,Z, got '0,0'"),
        ("ruler 0,0,nan 1,1,1", "--measure: must be a point X,Y,Z, got '0,0,nan'"),
        ("ruler:4 0,0,0 1,1,1", "--measure: samples are of a profile, got 4 for kind ruler"),
        ("profile:many 0,0,0 1,1,1", "--measure: must be a number of samples, at least 1, got 'many'"),
        ("profile:1 0,0,0 1,1,1", "--measure: samples must be a number from 2 to 100000, got 1"),
        ("", "--measure: must be KIND"),
    ],
)
def test_what_is_no_measure_is_one_line(
    folder: Path, wrong: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["measure", "v.npy", f"--measure={wrong}"]) == 2
    message = capsys.readouterr().err
    assert said in message and message.count("\n") == 1


@pytest.mark.parametrize(
    "table, said",
    [
        ('kind = "ruler"', "must have kind and points"),
        ('kind = "ruler"\npoints = [[0, 0, 0], [1, 1]]', "points must be an array of points [X, Y, Z]"),
        ('kind = "ruler"\npoints = 3', "points must be an array of points"),
        ('kind = "rod"\npoints = [[0, 0, 0], [1, 1, 1]]', "kind must be one of ruler, angle, box, profile, got 'rod'"),
        ('kind = "ruler"\npoints = [[0, 0, 0], [1, 1, 1]]\nlabel = "a"', "unknown key 'label'; keys are kind, points"),
        ('kind = "ruler"\npoints = [[0, 0, 0], [1, 1, 1]]\nshown = 1', "shown must be true or false, got 1"),
        ('kind = "profile"\npoints = [[0, 0, 0], [1, 1, 1]]\nsamples = true', "samples must be a number from 2"),
        ('kind = ["ruler"]\npoints = [[0, 0, 0], [1, 1, 1]]', "kind must be one of"),
    ],
)
def test_a_wrong_table_is_one_line(folder: Path, table: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "s.toml").write_text(f'volume = "v.npy"\n[[measure]]\n{table}\n', encoding="utf-8")
    assert tomllib.loads((folder / "s.toml").read_text())
    assert main(["measure", "--scene", "s.toml"]) == 2
    message = capsys.readouterr().err
    assert "s.toml: measure: " in message and said in message and message.count("\n") == 1


def test_nothing_to_measure_and_outputs_over_inputs_fail(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["measure", "v.npy"]) == 2
    assert "nothing to measure: give --measure" in capsys.readouterr().err
    before = (folder / "v.npy").read_bytes()
    assert main(["measure", "v.npy", f"--measure={RULER}", "-o", "v.npy"]) == 2
    assert (folder / "v.npy").read_bytes() == before
    assert main(["measure", "v.npy", f"--measure={RULER}", "-o", "missing/out.csv"]) == 2


def test_a_header_with_wrong_measures_is_one_line(folder: Path) -> None:
    assert main(["render", "v.npy", "--size", "16", "--tf", "fog", "-o", "a.png", f"--measure={RULER}"]) == 0
    attributes = dict(read_picture("a.png").attributes)
    wrong = attributes["texvol:scene"].replace('"ruler"', '"rod"')
    assert wrong != attributes["texvol:scene"]
    with pytest.raises(texvol.InputError, match="a.png: .*measure.*kind must be one of ruler.*got 'rod'"):
        stored_scene_of(attributes | {"texvol:scene": wrong}, name="a.png")
