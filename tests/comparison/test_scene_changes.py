"""Which parts of two scenes differ, by their headers, and that each picture is judged by its own scene alone."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.picture_project import Project, said
from support.scenes import smooth_volume

from texvol import Camera, ClipPlane, DepthCue, Light, Lighting, Mask, Scene, TransferFunction, Volume
from texvol.__main__ import main
from texvol.comparison import ci
from texvol.comparison.outcome import examine
from texvol.comparison.page import comparison_page
from texvol.comparison.pictures import Picture
from texvol.comparison.scene_changes import in_words, scene_changes
from texvol.comparison.three_way import each_by_its_own
from texvol.formats.pictures.image import write
from texvol.formats.pictures.scene_metadata import ATTRIBUTE, scene_metadata

pytest_plugins = ("pytester", "support.picture_project")

VOLUME = smooth_volume(10)
MEDIUM = TransferFunction(np.array([0, 1.0]), np.array([[0, 0, 0], [1, 1, 1.0]]), np.array([0, 0.5]))
DENSER = replace(MEDIUM, extinctions=np.array([0, 0.7]))
CAMERA = Camera.framing(VOLUME)
SCENE = Scene(VOLUME, MEDIUM, CAMERA, lighting=Lighting((Light("directional", (1, 0, 0)),)), classification="slab")
PIXELS = np.full((4, 5, 4), 0.5, np.float32)


def picture(scene: Scene, pixels: np.ndarray = PIXELS, checksum: bool = True, **metadata: Any) -> Picture:
    header = json.loads(scene_metadata("v.npy", scene, checksum=checksum)[ATTRIBUTE]) | metadata
    return Picture.of_array(pixels, "picture", {ATTRIBUTE: json.dumps(header)})


def other_values() -> Volume:
    return Volume(VOLUME.values + np.float32(0.25), VOLUME.spacing, VOLUME.origin)


def lit(*lights: Light) -> Scene:
    return replace(SCENE, lighting=Lighting(lights))


CHANGES = {
    "light": (lit(Light("directional", (0, 0, 1))), "lighting", "lights 1 vector (0, 0, 1) instead of (1, 0, 0)"),
    "a further light": (lit(Light("directional", (1, 0, 0)), Light("head")), "lighting", "instead of none"),
    "no light": (replace(SCENE, lighting=None), "lighting", "none instead of"),
    "camera": (replace(SCENE, camera=replace(CAMERA, fov=33.0, projection="perspective")), "camera", "fov 33 instead"),
    "background": (replace(SCENE, background=(1.0, 0, 0)), "background", "(1, 0, 0) instead of (0, 0, 0)"),
    "clip planes": (replace(SCENE, clip=(ClipPlane((1, 0, 0), 0.5),)), "clip", "normal (1, 0, 0), offset 0.5"),
    "crop": (replace(SCENE, crop=((0, 1), (0, 1), (0, 1))), "crop", "instead of none"),
    "matter": (replace(SCENE, transfer_function=DENSER), "transfer function", "points 2 extinction 0.7 instead of 0.5"),
    "mode": (Scene(VOLUME, camera=CAMERA, mode="mip", classification="slab"), "mode", "mip instead of none"),
    "classification": (replace(SCENE, classification="post"), "classification", "post instead of slab"),
    "depth cue": (replace(SCENE, depth_cue=DepthCue()), "depth cue", "instead of none"),
    "values": (replace(SCENE, volume=other_values()), "volume", "content, by its checksum,"),
    "spacing": (replace(SCENE, volume=Volume(VOLUME.values, (1, 1, 2), VOLUME.origin)), "volume", "spacing (1, 1, 2)"),
    "mask": (replace(SCENE, mask=Mask(np.ones(VOLUME.values.shape, bool))), "mask", "instead of none"),
}  # fmt: skip


@pytest.mark.parametrize("name", CHANGES)
def test_the_part_that_differs_is_named_with_both_values(name: str) -> None:
    changed, part, words = CHANGES[name]
    changes = scene_changes(picture(changed), picture(SCENE))
    assert changes and part in {each.part for each in changes}
    sentence = next(each for each in in_words(changes) if each.startswith(f"the scenes differ in {part}: "))
    assert words in sentence and len(sentence) < 400
    back = scene_changes(picture(SCENE), picture(changed))
    assert back is not None
    assert {(each.candidate, each.reference) for each in changes} == {(each.reference, each.candidate) for each in back}


def test_the_same_scene_has_no_changes() -> None:
    assert scene_changes(picture(SCENE), picture(SCENE)) == ()
    assert scene_changes(picture(SCENE, settings={"slab_thickness": 1.0}), picture(SCENE)) == ()
    elsewhere = {"volume": "/elsewhere/w.npy", "source": {"path": "/elsewhere/w.npy"}}
    assert scene_changes(picture(SCENE, **elsewhere), picture(SCENE)) == ()  # the checksum says that it is the same
    assert scene_changes(picture(SCENE, checksum=False), picture(SCENE)) == ()
    assert scene_changes(picture(SCENE, volume="data/v.npy", checksum=False), picture(SCENE)) == ()
    nudged = replace(CAMERA, eye=tuple(each * (1 + 1e-13) for each in CAMERA.eye))
    assert scene_changes(picture(replace(SCENE, camera=nudged)), picture(SCENE)) == ()


def test_parts_that_an_older_format_does_not_have_are_no_change() -> None:
    old = json.loads(picture(replace(SCENE, background=(1.0, 0, 0))).attributes[ATTRIBUTE])
    for key in ("format", "source", "checksum", "gradient"):
        old.pop(key, None)
    changes = scene_changes(Picture.of_array(PIXELS, "old", {ATTRIBUTE: json.dumps(old)}), picture(SCENE))
    assert changes is not None and {each.part for each in changes} == {"background"}


def test_another_file_without_checksums_is_another_volume() -> None:
    changes = scene_changes(picture(SCENE, checksum=False, volume="w.npy"), picture(SCENE))
    assert changes is not None
    assert [(each.part, each.where, each.candidate, each.reference) for each in changes] == [
        ("volume", "file", "w.npy", "v.npy")
    ]


def test_a_part_that_is_not_known_yet_counts() -> None:
    changes = scene_changes(picture(SCENE, air={"level": -1000}), picture(SCENE, air={"level": 0}))
    assert changes is not None and [each.part for each in changes] == ["air"]
    assert changes[0].words == "level -1000 instead of 0"


def test_what_pictures_do_not_show_is_no_change() -> None:
    first, other = ({"mode": "mip", "transfer_function": {"points": [level]}} for level in (1, 2))
    assert scene_changes(picture(SCENE, **first, window=[0, 1]), picture(SCENE, **other)) == ()
    eight = np.full((4, 5, 3), 128, np.uint8)
    windows = [picture(SCENE, eight, mode="mip", window=[level, 1]) for level in (0, 5)]
    changes = scene_changes(*windows)
    assert changes is not None and [each.part for each in changes] == ["window"]


@pytest.mark.parametrize(
    "text",
    ["", "[", "[1]", "{}", '{"a": 1e400}', '{"a": ' + "[" * 3000 + "]" * 3000 + "}", '{"a": 1' + "0" * 400 + "}"],
)
def test_any_header_is_compared_or_none(text: str) -> None:
    pair = [Picture.of_array(PIXELS, "picture", {ATTRIBUTE: each}) for each in (text, '{"a": [2]}')]
    changes = scene_changes(pair[0], pair[1])
    assert changes is None or all(each.words for each in changes)


def test_two_scenes_are_neither_better_nor_worse() -> None:
    rng = np.random.default_rng(1)
    ours, theirs, first, second = rng.random((4, 5, 6, 4))
    found = each_by_its_own(ours, theirs, (first, second))
    assert found.verdict == "other scene" and "there is no verdict" in found.words
    assert found.candidate_error is not None and found.reference_error is not None
    assert found.candidate_error.max_error == np.abs(ours - first).max()
    assert found.reference_error.max_error == np.abs(theirs - second).max()
    # A part that does not show: there is one truth after all.
    assert each_by_its_own(first, theirs, (first, first)).verdict == "better"
    one = each_by_its_own(ours, theirs, (None, second), reasons=["the candidate was not judged"])
    assert one.candidate_error is None and "not judged" in one.words


@pytest.fixture
def drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One volume, drawn under two lights, and more finely."""
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", VOLUME.values)
    options = {
        "old": ("--light", "0,0,1"),
        "new": ("--light", "1,0,0"),
        "fine": ("--light", "0,0,1", "--sampling-rate", "8"),
    }
    for name, more in options.items():
        line = ["render", "v.npy", "-o", f"{name}.exr", "--size", "24x20", "--classification", "slab"]
        assert main([*line, *more]) == 0
    return tmp_path


def told(capsys: pytest.CaptureFixture[str], *line: str) -> tuple[int, dict[str, Any]]:
    capsys.readouterr()
    status = main(["diff", *line, "--json"])
    return status, json.loads(capsys.readouterr().out)


def test_diff_says_that_the_light_changed_and_does_not_judge(drawn: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, metadata = told(capsys, "new.exr", "old.exr", "--detailed-exitcode")
    assert status == 1  # neither worse (4) nor better (5)
    assert {each["part"] for each in metadata["scene_changes"]} == {"lighting"}
    assert metadata["oracle"]["verdict"] == "other scene"
    # Each is nearly right, of its own scene: they are far apart all the same.
    assert max(metadata["oracle"][f"{role}_error"]["rms_error"] for role in ("candidate", "reference")) < 0.02
    assert metadata["measures"]["parts"]["all"]["rms_error"] > 0.03
    main(["diff", "new.exr", "old.exr", "--html", "page.html"])
    for text in (capsys.readouterr().out, Path("page.html").read_text("utf-8")):
        assert "the scenes differ in lighting" in text and "(1, 0, 0) instead of (0, 0, 1)" in text
        assert "changed for the" not in text


def test_another_sampling_rate_is_the_same_scene(drawn: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, metadata = told(capsys, "fine.exr", "old.exr", "--detailed-exitcode")
    assert status == 5 and metadata["oracle"]["verdict"] == "better" and metadata["scene_changes"] == []
    assert any("settings of the drawing differ: slab thickness" in note for note in metadata["notes"])


def test_that_values_may_have_changed_is_said_where_no_checksum_tells(
    drawn: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for rate, name in (("1", "a.png"), ("8", "b.png")):
        assert main(["render", "v.npy", "-o", name, "--size", "24x20", "--sampling-rate", rate]) == 0
    _, metadata = told(capsys, "a.png", "b.png")
    assert any("a.png and b.png: the header holds no checksum" in note for note in metadata["notes"])
    _, metadata = told(capsys, "fine.exr", "old.exr")
    assert not any("no checksum" in note for note in metadata["notes"])


@pytest.mark.parametrize("candidate", [True, False])
def test_a_picture_that_names_no_scene_is_not_judged(
    drawn: Path, capsys: pytest.CaptureFixture[str], candidate: bool
) -> None:
    from texvol.formats.pictures.image import read

    write("bare.exr", read("fine.exr"))
    pair = ("bare.exr", "old.exr") if candidate else ("old.exr", "bare.exr")
    status, metadata = told(capsys, *pair, "--detailed-exitcode")
    assert status == 1 and metadata["scene_changes"] is None
    assert metadata["oracle"]["verdict"] == "unknown" and "names no scene" in metadata["oracle"]["words"]


def test_a_volume_that_has_changed_is_held_against_what_is_left(
    drawn: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save("v.npy", VOLUME.values**2)
    assert main(["render", "v.npy", "-o", "changed.exr", "--size", "24x20", "--light", "0,0,1"]) == 0
    status, metadata = told(capsys, "changed.exr", "old.exr")
    assert status == 1 and "volume" in {each["part"] for each in metadata["scene_changes"]}
    assert metadata["oracle"]["verdict"] == "other scene" and metadata["oracle"]["reference_error"] is None
    assert metadata["oracle"]["candidate_error"] is not None and "the file has changed" in metadata["oracle"]["words"]


def test_annotations_and_pages_name_the_part() -> None:
    outcome = examine(picture(CHANGES["light"][0]), picture(SCENE, PIXELS * np.float32(0.5)))
    line = ci.workflow_commands([ci.Result.of(outcome)], {})[0]
    assert "the scenes differ in lighting" in line
    assert "the scenes differ in lighting" in comparison_page(outcome)
    assert outcome.as_json()["scene_changes"][0]["part"] == "lighting"


LIT = """
import os
from texvol import Lighting, Light, Scene, Volume
y = np.linspace(0, 6, 10)
VOLUME = Volume((0.5 + 0.5 * np.sin(y[:, None, None] + y[:, None] * 2 - y)).astype(np.float32))

def scene():
    towards = tuple(map(float, os.environ["LIGHT"].split(",")))
    return Scene(VOLUME, lighting=Lighting((Light("directional", towards),)))

def test_it(check_picture):
    check_picture(scene(), "lit", size=(24, 20), sampling_rate=float(os.environ.get("RATE", 1)))
"""


def test_a_test_s_scene_with_another_light_is_not_better(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    project.write(test_it=LIT)
    monkeypatch.setenv("LIGHT", "0,0,1")
    assert project.run("--texvol-update").ret == 0
    monkeypatch.setenv("RATE", "8")
    assert "changed for the better" in said(project.run())
    monkeypatch.setenv("LIGHT", "1,0,0")
    text = said(project.run("--texvol-report", "report"))
    assert "the scenes differ in lighting: lights 1 vector (1, 0, 0) instead of (0, 0, 1)" in text
    assert "there is no verdict" in text and "changed for the" not in text
    assert "; the reference differs from the oracle of its own scene by rms" in text  # in memory, and so found
    record = project.report()["by_name"]["lit"]
    assert any("the scenes differ in lighting" in each for each in record["kinds"])
