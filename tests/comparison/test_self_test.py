"""Limits put to the test: what they catch and miss of mistakes, in which scenes, and how that is said."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from support.benches import NAMED, SIZE
from support.real_data import real_volume
from support.scenes import constant, random_volume

from texvol.__main__ import main
from texvol.comparison import mistakes, self_test_page
from texvol.comparison import self_test as self_test_module
from texvol.comparison.limits import NONE, ONE_DRIVER, TWO_DRIVERS
from texvol.comparison.mistakes import CATALOGUE, Mistake, MistakeTrial, drawn
from texvol.comparison.pictures import read_picture
from texvol.comparison.self_test import CAUGHT, FALSE_ALARM, MISSED, NO_MEANING, NOTHING, SAME, SelfTest, self_test
from texvol.formats.pictures import image
from texvol.provenance.stored_scene import StoredScene, stored_scene_of
from texvol.scene.camera import Camera
from texvol.scene.demo import demo_scene
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

DEMO = StoredScene(demo_scene(), name="demo")


def status(test: SelfTest, name: str) -> str:
    return next(row.status for row in test.rows if row.name == name)


def test_what_changes_nothing_is_neither_caught_nor_missed() -> None:
    volume = Volume(np.ones((6, 6, 6), np.float32))
    camera = Camera.orthographic((2.5, 2.5, -20), (2.5, 2.5, 2.5), (0, 1, 0), height=5)
    test = self_test(
        StoredScene(Scene(volume, constant(0.1), camera, classification="slab")), SIZE, NONE, controls=False
    )
    for name in ("half a texel", "other axis", "swapped order"):
        assert status(test, name) == NOTHING
    assert status(test, "missing cosine") == NO_MEANING


Drawn = list[tuple[Mistake, Any]]


@pytest.fixture(scope="module")
def demo_test_and_pictures() -> tuple[SelfTest, Drawn]:
    """A self-test of the demo, and the pictures that it compared."""
    pictures: Drawn = []

    def kept(trial: MistakeTrial) -> Iterator[tuple[Mistake, Any]]:
        for each in drawn(trial):
            pictures.append(each)
            yield each

    with patch.object(self_test_module, "drawn", kept):
        return self_test(DEMO, SIZE, ONE_DRIVER), pictures


@pytest.fixture
def demo_test(demo_test_and_pictures: tuple[SelfTest, Drawn]) -> SelfTest:
    return demo_test_and_pictures[0]


@pytest.fixture
def drawn_before(demo_test_and_pictures: tuple[SelfTest, Drawn], monkeypatch: pytest.MonkeyPatch) -> None:
    """Self-tests of the demo compare the pictures of the first one."""
    monkeypatch.setattr(self_test_module, "drawn", lambda trial: demo_test_and_pictures[1])


def test_the_default_limits_catch_every_mistake_in_the_demo(demo_test: SelfTest) -> None:
    assert demo_test.passed, demo_test.as_text()
    assert {status(demo_test, name) for name in NAMED} == {CAUGHT}
    controls = [row for row in demo_test.rows if row.is_control]
    assert len(controls) == 2
    assert controls[0].status == SAME
    assert all(row.caught_by for row in demo_test.rows if row.status == CAUGHT)


@pytest.mark.usefixtures("drawn_before")
def test_limits_that_are_too_loose_miss_and_say_what() -> None:
    loose = replace(ONE_DRIVER, max_abs=0.05, rms=0.01, flip=0.02, source="loose")
    test = self_test(DEMO, SIZE, loose, controls=False)
    assert not test.passed
    assert status(test, "8-bit target") == MISSED
    assert status(test, "other axis") == CAUGHT
    missed = sum(row.status == MISSED for row in test.rows)
    caught = sum(row.status == CAUGHT for row in test.rows)
    assert f"{caught} of {caught + missed} visible mistakes are caught" in test.as_text()


@pytest.mark.usefixtures("drawn_before")
def test_a_limit_catches_by_itself_what_it_is_said_to_catch() -> None:
    one = self_test(DEMO, SIZE, replace(NONE, hard_max=0.3, fail_percent=100), controls=False)
    for row in one.rows:
        assert not row.numbers or (row.status == CAUGHT) == (row.numbers["max_error"] > 0.3)
        assert row.caught_by == (("hard-max",) if row.status == CAUGHT else ())


@pytest.mark.usefixtures("drawn_before")
def test_limits_that_refuse_the_same_picture_are_a_false_alarm(monkeypatch) -> None:
    right = MistakeTrial.draw
    shaken = np.random.default_rng(0).normal(0, 0.01, (SIZE[1], SIZE[0], 4))
    monkeypatch.setattr(MistakeTrial, "draw", lambda self, *args, **more: right(self, *args, **more) + shaken)
    test = self_test(DEMO, SIZE, ONE_DRIVER, controls=False)
    assert status(test, "no mistake") == FALSE_ALARM
    assert not test.passed


def test_numbers_are_held_against_limits_as_shares_of_their_range() -> None:
    thousands = Scene(Volume(random_volume(3).values * 1000), mode="mip", classification="slab")
    ones = Scene(random_volume(3), mode="mip", classification="slab")
    tests = [self_test(StoredScene(scene), SIZE, TWO_DRIVERS, controls=False) for scene in (thousands, ones)]
    for ours, theirs in zip(tests[0].rows, tests[1].rows, strict=True):
        assert (ours.name, ours.status) == (theirs.name, theirs.status)
    assert status(tests[0], "one wrong pixel") == CAUGHT


def test_texts_for_people_and_machines(demo_test: SelfTest) -> None:
    text, content = demo_test.as_text(), json.loads(json.dumps(demo_test.as_json(), allow_nan=False))
    for name in NAMED:
        assert re.search(rf"^{name} +caught ", text, re.MULTILINE)
    lines = text.splitlines()
    assert len({line.index("caught") for line in lines if re.match("half|wrong|other", line)}) == 1  # aligned
    assert content["passed"] is True
    assert [row["name"] for row in content["rows"]] == [row.name for row in demo_test.rows]
    assert all(row["max_error"] > 0 for row in content["rows"] if row["status"] == CAUGHT)


def test_the_page_has_every_mistake_and_asks_for_nothing(demo_test: SelfTest) -> None:
    page = self_test_page.page(demo_test)
    assert all(f"<b>{name}</b>" in page for name in NAMED)
    assert page.count('src="data:image/png;base64,') == 1 + 2 * sum(
        row.picture is not None and not row.is_control for row in demo_test.rows
    )
    assert not re.search(r"(?:src|href)=\"(?!data:)", page)


# Scenes from files.


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    np.save("noise.npy", random_volume(3).values)
    return tmp_path


@pytest.mark.parametrize("kind", ["exr", "png", "toml", "npy"])
def test_a_scene_comes_from_a_picture_a_scene_file_or_a_volume(kind: str, folder: Path, capsys, monkeypatch) -> None:
    if kind != "exr":
        few = [each for each in CATALOGUE if each.name in ("wrong gamma", "straight colour")]
        monkeypatch.setattr(mistakes, "CATALOGUE", few)
    if kind in ("exr", "png"):
        assert main(["render", "noise.npy", "-o", f"noise.{kind}", "--size", "40x30", "--tf", "fog"]) == 0
    (folder / "noise.toml").write_text('volume = "noise.npy"\ntf = "fog"\nsize = "40x30"\n')
    capsys.readouterr()
    found = main(["diff", "--self-test", f"noise.{kind}", "--json"])
    content = json.loads(capsys.readouterr().out)
    assert content["size"] == ([256, 256] if kind == "npy" else [40, 30])
    assert found == (0 if content["passed"] else 1)
    assert content["scene"] == f"noise.{kind}"


def test_the_self_test_writes_a_page_and_its_status_is_1_where_a_mistake_is_missed(folder: Path, capsys) -> None:
    assert main(["render", "noise.npy", "-o", "noise.exr", "--size", "40x30", "--tf", "fog"]) == 0
    assert main(["diff", "--self-test", "noise.exr", "--html", "page.html", "--hard-max", "0.3"]) == 1
    assert "one wrong pixel" in capsys.readouterr().out
    assert "<!DOCTYPE html>" in (folder / "page.html").read_text()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("none.exr", None, "none.exr: cannot be read"),
        ("none.npy", None, "none.npy"),
        ("plain.png", None, "plain.png: has no scene in its header"),
        ("empty.toml", "", "VOLUME is required"),
        ("wrong.toml", "volume = 3\n", "wrong.toml: volume must be the path"),
        ("lost.toml", 'volume = "lost.npy"\n', "lost.npy"),
        ("shape.toml", "shape = [1, 2, 3]\n", "shape.toml: shape needs a volume"),
    ],
)
def test_what_stands_for_no_scene_is_one_line(
    name: str, content: str | None, message: str, folder: Path, capsys
) -> None:
    image.write("plain.png", np.zeros((4, 4, 4), np.float32))
    if content is not None:
        Path(name).write_text(content)
    assert main(["diff", "--self-test", name]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_a_scene_file_may_name_its_volume_and_how_it_is_read(folder: Path) -> None:
    (folder / "scenes").mkdir()
    random_volume(3).values.tofile("scenes/noise.raw")
    Path("scenes/noise.toml").write_text(
        'volume = "noise.raw"\nshape = [9, 8, 7]\ndtype = "<f4"\nspacing = [1, 1.3, 0.7]\ntf = "fog"\nsize = "24x20"\n'
    )
    assert main(["render", "--scene", "scenes/noise.toml", "-o", "file.exr"]) == 0
    line = ["--shape", "9,8,7", "--dtype", "<f4", "--spacing", "1,1.3,0.7", "--tf", "fog", "--size", "24x20"]
    assert main(["render", "scenes/noise.raw", *line, "-o", "line.exr"]) == 0
    np.testing.assert_array_equal(image.read("file.exr"), image.read("line.exr"))
    # A volume on the line is another one, and read as the line says.
    assert main(["render", "noise.npy", "--scene", "scenes/noise.toml", "-o", "other.exr"]) == 0
    np.testing.assert_array_equal(image.read("other.exr"), image.read("line.exr"))


def test_a_command_without_a_volume_says_so(folder: Path, capsys) -> None:
    Path("s.toml").write_text('tf = "fog"\n')
    for line in (["render", "-o", "x.exr"], ["render", "--scene", "s.toml", "-o", "x.exr"], ["raycast", "-o", "x.exr"]):
        assert main(line) == 2
        assert "VOLUME" in capsys.readouterr().err
    assert not Path("x.exr").exists()


def test_a_mistake_in_a_real_volume_is_caught_and_told(tmp_path, monkeypatch) -> None:
    path = real_volume("flair/FLAIR.nrrd")
    monkeypatch.chdir(tmp_path)
    assert main(["render", str(path), "-o", "flair.exr", "--size", "64x64"]) == 0
    stored = stored_scene_of(read_picture("flair.exr").attributes, name="flair.exr")
    test = self_test(stored, (64, 64), ONE_DRIVER, controls=False)
    assert {status(test, name) for name in NAMED} == {CAUGHT}
